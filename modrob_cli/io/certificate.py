"""Certificates of scaled motions as JSON files."""

import hashlib
import json
import math
from pathlib import Path
from typing import Any

from modrob_cli.errors import Fault, InputFileError

KIND = "scale-certificate/1"
_KEYS = {
    "modrob": str,
    "tool": str,
    "statement": str,
    "robot": str,
    "trajectory": str,
    "topic": str | None,
    "inputs": dict,
    "options": dict,
    "joints": list,
    "duration": float,
    "limits": dict,
    "sampled_factor": float,
    "critical": dict | None,
    "factor": float,
    "proven": list,
    "speed": dict,
    "cells": dict,
    "digest": str,
}


def digest(content: dict[str, Any]) -> str:
    """Hash of everything but the digest itself; numbers with all their digits."""
    rest = {key: value for key, value in content.items() if key != "digest"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def certificate_text(content: dict[str, Any]) -> str:
    """Text of a certificate; its digest is added."""
    return json.dumps({**content, "digest": digest(content)}, indent=1, allow_nan=False) + "\n"


def read_certificate(path: Path) -> dict[str, Any]:
    """Read a certificate; whether what it says is true is for others to find out.

    Raises
    ------
    InputFileError
        If it cannot be read, or lacks something.
    """
    try:
        content = json.loads(path.read_bytes().decode(), parse_constant=_refuse)
    except OSError as error:
        raise InputFileError(Fault(str(path), f"cannot be read: {error.strerror}")) from error
    except (ValueError, RecursionError) as error:
        message = f"found no JSON ({error}), expected a certificate that modrob scale --certify wrote"
        raise InputFileError(Fault(str(path), message)) from error
    faults = [Fault(str(path), message) for message in _shape_faults(content)]
    if faults:
        raise InputFileError(faults)
    return dict(content)


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


def _shape_faults(content: Any) -> list[str]:
    if not isinstance(content, dict) or content.get("modrob") != KIND:
        return [f"found no certificate, expected a JSON object with modrob: {KIND}"]
    out = [f"the key {key} is missing" for key in _KEYS if key not in content]
    out += [f"unknown key {key[:60]!r}" for key in content if key not in _KEYS]
    for key, kind in _KEYS.items():
        if key in content and not _is(content[key], kind):
            out.append(f"{key}: found {type(content[key]).__name__}, expected {getattr(kind, '__name__', kind)}")
    return out or _number_faults(content)


def _is(value: Any, kind: Any) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return isinstance(value, kind)


def _number_faults(content: dict[str, Any]) -> list[str]:
    """Arrays of the wrong size or with something else than numbers."""
    n = len(content["joints"])
    cells, speed, limits = content["cells"], content["speed"], content["limits"]
    edges = cells.get("edges")
    count = len(edges) - 1 if isinstance(edges, list) else 0
    wanted = [
        ("cells.edges", edges, (count + 1,)),
        ("cells.lower", cells.get("lower"), (count, n)),
        ("cells.upper", cells.get("upper"), (count, n)),
        ("speed.lower", speed.get("lower"), (3, n)),
        ("speed.upper", speed.get("upper"), (3, n)),
        ("proven", content["proven"], (len(content["proven"]), 2)),
        ("limits.torque_lower", limits.get("torque_lower"), (n,)),
        ("limits.torque_upper", limits.get("torque_upper"), (n,)),
    ]
    names = [] if all(isinstance(name, str) for name in content["joints"]) else ["joints: expected names"]
    few = [] if count >= 1 and n >= 1 else ["expected one joint and one cell at least"]
    return [
        *names,
        *few,
        *(
            f"{name}: expected numbers of shape {shape}"
            for name, value, shape in wanted
            if not _has_shape(value, shape, name.startswith("limits"))
        ),
    ]


def _has_shape(value: Any, shape: tuple[int, ...], gaps: bool) -> bool:
    """True for nested lists of finite numbers of this shape; ``gaps``: or None."""
    if not shape:
        return (gaps and value is None) or _is(value, float)
    return isinstance(value, list) and len(value) == shape[0] and all(_has_shape(x, shape[1:], gaps) for x in value)
