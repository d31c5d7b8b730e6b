"""``modrob pack`` and ``modrob unpack``: on-module storage."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from modrob_cli.cli.console import say
from modrob_cli.cli.options import Overwrite

if TYPE_CHECKING:
    from modrob_cli.io.module_storage_record import StoredModule
    from modrob_cli.workflows.pack import PackResult

Kind = Literal["base", "link", "joint", "end-effector"]
ModuleFile = Annotated[Path, typer.Argument(metavar="MODULE", help="A module/1 document.")]
BinaryFile = Annotated[Path, typer.Argument(metavar="FILE.bin", help="On-module storage, plain or extended.")]
OutBinary = Annotated[Path, typer.Option("--out", "-o", metavar="FILE.bin", help="File to write.")]
OutModule = Annotated[Path, typer.Option("--out", "-o", metavar="FILE.yaml", help="Document to write.")]
Extended = Annotated[bool, typer.Option("--extended", help="With bounds, limits, names and a checksum.")]
KindOption = Annotated[Kind | None, typer.Option("--kind", help="Plain form: kind of module (by size if left out).")]
NameOption = Annotated[str | None, typer.Option("--name", metavar="NAME", help="Plain form: name of the module.")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command("pack", epilog="Example: modrob pack modules/schunk-lwa4p/PB1.yaml -o PB1.bin")(pack)
    app.command("unpack", epilog="Example: modrob unpack PB1.bin --name PB1 -o PB1.yaml")(unpack)


def pack(module: ModuleFile, out: OutBinary, extended: Extended = False, overwrite: Overwrite = False) -> None:
    """Write a module's data as the bytes that a module carries.

    The plain form is 148 bytes per joint unit or 64 per output connector, single precision, little endian; what it
    cannot hold is said. The extended form holds all of the module. Both are described in docs/storage.md.
    """
    from modrob_cli.workflows import pack as workflow

    result = workflow.pack(module, out, extended, overwrite)
    _warn(result)
    form = "extended" if extended else "plain"
    say(f"wrote {result.path}: {_describe(result.module)}, {form} form, {result.size} bytes")


def unpack(
    file: BinaryFile, out: OutModule, kind: KindOption = None, name: NameOption = None, overwrite: Overwrite = False
) -> None:
    """Write the module document that on-module storage stands for.

    The plain form holds neither name nor kind: pass --name, and --kind for a base or an end effector.
    """
    from modrob_cli.workflows import pack as workflow

    result = workflow.unpack(file, out, kind, name, overwrite)
    _warn(result)
    say(f"wrote {result.path}: {_describe(result.module)}")


def _warn(result: "PackResult") -> None:
    for warning in result.warnings:
        say(f"warning: {warning}")


def _describe(module: "StoredModule") -> str:
    count = len(module.units) or len(module.outputs)
    part = "unit" if module.units else "output"
    return f"{module.kind} module {module.name} with {count} {part}{'s' * (count != 1)}"
