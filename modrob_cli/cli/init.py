"""``modrob init``: a workspace for a new user."""

from pathlib import Path
from typing import Annotated

import typer

from modrob_cli.cli.console import say
from modrob_cli.cli.options import Overwrite

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the workspace; made if it is not there.")]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("init", epilog="Example: modrob init my-arm")(init)


def init(folder: Folder, overwrite: Overwrite = False) -> None:
    """Lay out a workspace with modules/, assemblies/, trajectories/ and scenarios/.

    The shipped catalogue and assemblies are copied, with a README that says what to do next. Files that exist are
    left alone, and then nothing is written, unless --overwrite is given.
    """
    from modrob_cli.workflows import init as workflow

    workspace = workflow.init(folder, overwrite)
    counts = {name: sum(file.parts[0] == name for file in workspace.files) for name in ("modules", "assemblies")}
    say(f"laid out {workspace.folder}: {counts['modules']} modules, {counts['assemblies']} assemblies, a README")
    say(f"next: cd {workspace.folder} && modrob check .")
