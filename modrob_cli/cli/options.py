"""Options that several subcommands share."""

from pathlib import Path
from typing import Annotated

import typer

OutDir = Annotated[Path, typer.Option("--out", "-o", metavar="DIR", help="Folder for the output files.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace output files that exist.")]
Strict = Annotated[bool, typer.Option("--strict", help="Treat warnings as errors.")]

DEFAULT_OUT = Path("out")


def numbers(text: str | None, option: str) -> list[float] | None:
    """Comma-separated finite numbers or angles (``pi/2``, ``90 deg``) of an option.

    Raises
    ------
    UsageError
        If a part is not a number.
    """
    import math

    from pydantic_core import PydanticCustomError

    from modrob_cli.errors import UsageError
    from modrob_cli.schema.base import parse_angle

    if text is None:
        return None
    out = []
    for part in text.split(","):
        try:
            value = float(parse_angle(part)) if part.strip()[-1:].isalpha() or "pi" in part else float(part)
        except (ValueError, PydanticCustomError):
            value = math.nan
        if not math.isfinite(value):
            raise UsageError(f"{option}: found {part.strip()!r}, expected comma-separated finite numbers")
        out.append(value)
    return out
