"""Columns of a sampled motion, matched with the joints of a robot."""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Indices
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.yaml_builder import shorten

KINDS = {"q": "positions", "dq": "velocities", "ddq": "accelerations"}

_BY_NAME = re.compile(r"(q|dq|ddq)\.(.+)")
_BY_NUMBER = re.compile(r"(q|dq|ddq)([0-9]+)")
_NUMBER = re.compile(r"[+-]?[0-9.]+([eE][+-]?[0-9]+)?")
_SHOWN = 12


def column_order(
    file: str, header: Sequence[str], joint_names: Sequence[str], kinds: Sequence[str] = tuple(KINDS)
) -> Indices:
    """Indices of the columns t, q, dq, ddq in the order of the robot's joints, shape (1 + 3 n,).

    Parameters
    ----------
    kinds : which of q, dq, ddq are expected

    Raises
    ------
    InputFileError
        With everything that is wrong with the header.
    """
    messages = list(_faults(header, joint_names, kinds))
    if messages:
        raise InputFileError([Fault(file, message, line=1) for message in messages])
    keys = _keys(header, joint_names, kinds)
    return np.array([header.index(name) for name in keys])


def joints_of(header: Sequence[str]) -> tuple[str, ...] | None:
    """Joints that a header names, in the order of their positions; None if it counts them or has none."""
    return tuple(match[2] for name in header if (match := _BY_NAME.fullmatch(name)) and match[1] == "q") or None


def count_of(header: Sequence[str]) -> int:
    """Number of columns of positions that a header counts, at least 1."""
    return max(sum(_BY_NUMBER.fullmatch(name) is not None and name[0] == "q" for name in header), 1)


def kinds_of(header: Sequence[str]) -> list[str]:
    """Which of q, dq, ddq a header has, q always; dq too where it has ddq."""
    matches = (_BY_NAME.fullmatch(name) or _BY_NUMBER.fullmatch(name) for name in header)
    found = {match[1] for match in matches if match}
    return ["q", *(["dq"] if found & {"dq", "ddq"} else []), *(["ddq"] if "ddq" in found else [])]


def _keys(header: Sequence[str], joint_names: Sequence[str], kinds: Sequence[str]) -> list[str]:
    """Names that the columns should have, in the style (by name or by number) that the header uses."""
    by_name = any(_BY_NAME.fullmatch(name) for name in header)
    labels = [f".{name}" for name in joint_names] if by_name else [str(k + 1) for k in range(len(joint_names))]
    return ["t", *(f"{kind}{label}" for kind in kinds for label in labels)]


def _faults(header: Sequence[str], joint_names: Sequence[str], kinds: Sequence[str]) -> list[str]:
    n = len(joint_names)
    last = "" if n == 1 else f"..{{}}{n}"
    form = ",".join(["t", *(f"{kind}1{last.format(kind)}" for kind in kinds)])
    if len(header) == 1 and ";" in header[0]:
        return [f"found semicolons between the columns, expected commas: {form}"]
    if all(_NUMBER.fullmatch(name) for name in header):
        return [f"found numbers in the first line, expected a header: {form}, or t,q.NAME,..."]
    repeated = [name for name, count in Counter(header).items() if count > 1]
    if repeated:
        return [f"found repeated columns: {_list(repeated)}; expected each once"]
    wanted = _keys(header, joint_names, kinds)
    missing = [name for name in wanted if name not in header]
    unknown = [name for name in header if name not in wanted]
    if not missing and not unknown:
        return []
    return _joint_faults(header, joint_names) or _column_faults(missing, unknown, n, form)


def _joint_faults(header: Sequence[str], joint_names: Sequence[str]) -> list[str]:
    """Faults of a header that is about other joints than the robot's."""
    named = [match[2] for name in header if (match := _BY_NAME.fullmatch(name))]
    if named:
        found = list(dict.fromkeys(named))
        if set(found) == set(joint_names):
            return []
        both = f"found the joints {_list(found)}; the robot has {_list(joint_names)}"
        return [f"{both}; expected columns for exactly the robot's joints, rename or remove columns"]
    highest = max((int(match[2][:9]) for name in header if (match := _BY_NUMBER.fullmatch(name))), default=None)
    if highest is not None and highest > len(joint_names):
        n = len(joint_names)
        both = f"found columns for {highest} joints, expected {n}, in this order: {_list(joint_names)}"
        return [f"{both}; is this the motion of another robot?"]
    return []


def _column_faults(missing: list[str], unknown: list[str], n: int, form: str) -> list[str]:
    """Faults of a header that lacks columns or has more."""
    out = []
    rest = list(missing)
    for kind, meaning in KINDS.items():
        of_kind = [name for name in missing if re.fullmatch(rf"{kind}(\.|[0-9]).*", name)]
        if len(of_kind) == n:
            out.append(f"found no {meaning}, expected the columns {_list(of_kind)} too")
            rest = [name for name in rest if name not in of_kind]
    if rest:
        out.append(f"the columns {_list(rest)} are missing; expected {form}, or t,q.NAME,...")
    if unknown:
        zero = " (joints count from 1)" if "q0" in unknown else ""
        out.append(f"found the unknown columns {_list(unknown)}; expected {form} and no others{zero}")
    return out


def _list(names: Sequence[str]) -> str:
    shown = ", ".join(shorten(name)[1:-1] if len(name) < 40 else shorten(name) for name in names[:_SHOWN])
    return shown + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")
