"""``modrob check``: validate documents, physical plausibility included."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modrob_cli.cli.console import print_json, say
from modrob_cli.cli.options import AsJson, Strict
from modrob_cli.errors import Fault, InputFileError

if TYPE_CHECKING:
    from modrob_cli.workflows.check import CheckResult

Paths = Annotated[list[Path], typer.Argument(metavar="PATH...", help="Documents, or folders of documents.")]


def register(app: typer.Typer) -> None:
    """Add the command."""
    example = "Example: modrob check modules assemblies --strict"
    app.command("check", epilog=example, no_args_is_help=True)(check)


def check(paths: Paths, strict: Strict = False, as_json: AsJson = False) -> None:
    """Validate documents, physical plausibility included.

    Every fault of every file is listed, with file, line and place. Data that no real body can have, or that hardly
    any arm has, give warnings; with --strict they count as faults.
    """
    from modrob_cli.workflows import check as workflow

    result = workflow.check(paths)
    _report(result)
    if as_json:
        print_json(_as_json(result, strict))
    if not result.is_ok(strict):
        raise typer.Exit(InputFileError.exit_code)


def _report(result: "CheckResult") -> None:
    for fault in result.faults:
        say(f"error: {fault}")
    for warned in result.warnings:
        say(f"warning: {warned.fault}")
    say(summary_line(result))


def summary_line(result: "CheckResult") -> str:
    """Counts of documents, faults and warnings."""
    documents = f"{len(result.files)} document{'s' * (len(result.files) != 1)} checked"
    faults, warnings = len(result.faults), len(result.warnings)
    parts = [f"{faults} fault{'s' * (faults != 1)}"] * bool(faults)
    return ", ".join([documents, *parts, f"{warnings} warning{'s' * (warnings != 1)}"])


def _as_json(result: "CheckResult", strict: bool) -> dict[str, Any]:
    files = [
        {
            "file": checked.file,
            "kind": checked.kind,
            "faults": [_entry(fault) for fault in checked.faults],
            "warnings": [{**_entry(warned.fault), "level": warned.level} for warned in checked.warnings],
        }
        for checked in result.files
    ]
    return {"files": files, "ok": result.is_ok(strict)}


def _entry(fault: Fault) -> dict[str, object]:
    place = {"file": fault.file, "line": fault.line, "column": fault.column}
    return {**place, "path": fault.path, "message": fault.message}
