"""The record that a log is done: NAME.COMMAND.json, written last, with hashes of what went in and what came out."""

import hashlib
import json
from pathlib import Path
from typing import Any

from modrob_cli import __version__
from modrob_cli.io.outputs import sha256


def record_text(record: dict[str, Any]) -> str:
    """A record as its file has it."""
    return json.dumps(record, indent=2, allow_nan=False) + "\n"


def key_digest(key: dict[str, Any]) -> str:
    """Digest of plain data that decides a result, this version of the tool included."""
    text = json.dumps({"modrob": __version__, **key}, sort_keys=True, default=str)
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def read_record(folder: Path, name: str, key: str) -> dict[str, Any] | None:
    """A record of an earlier run that was made under the same key and whose files are all there, unchanged.

    Returns
    -------
    record : None if there is none, or it is stale; also if the file is not a record at all
    """
    try:
        record = json.loads((folder / name).read_bytes())
        made = record["provenance"]
        if made["key"] != key or not isinstance(made["log"], str):
            return None
        for output, digest in made["outputs"].items():
            if Path(output).name != output or f"sha256:{sha256(folder / output)}" != digest:
                return None
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
    return record if isinstance(record, dict) else None
