"""What people see: text on stderr, results as JSON on stdout."""

import json
import sys
from collections.abc import Sequence
from typing import Any

import typer

from modrob_cli.cli.quiet import silence


def say(text: str = "") -> None:
    """Print a line for people, on stderr; nothing if nobody can read it any more."""
    try:
        typer.echo(text, err=True)
    except OSError:
        silence(sys.stderr)


def print_json(result: Any) -> None:
    """Print the result on stdout as JSON; NaN and infinity never appear in it.

    Raises
    ------
    ValueError
        If the result holds a number that JSON does not have.
    """
    typer.echo(json.dumps(result, indent=2, allow_nan=False))


def table(header: Sequence[str], rows: Sequence[Sequence[object]], indent: str = "  ") -> str:
    """Lay text out in columns; numbers to the right, text to the left."""
    cells = [[_cell(value) for value in row] for row in rows]
    widths = [max(len(row[k]) for row in [list(header), *cells]) for k in range(len(header))]
    numeric = [bool(rows) and all(isinstance(row[k], int | float) for row in rows) for k in range(len(header))]
    lines = []
    for row in [list(header), *cells]:
        parts = [
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(row, widths, numeric, strict=True)
        ]
        lines.append((indent + "  ".join(parts)).rstrip())
    return "\n".join(lines)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "0" if value == 0.0 else f"{value:.5g}"
    return str(value)
