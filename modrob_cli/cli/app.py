"""The ``modrob`` command: subcommands and the boundary where errors become messages and exit codes."""

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from modrob_cli import __version__
from modrob_cli.cli import (
    assemble,
    bounds,
    check,
    collision,
    demo,
    identify,
    init,
    log,
    pack,
    scale,
    schema,
    simulate,
    trajectory,
    validate,
)
from modrob_cli.errors import ModrobError


class ModrobGroup(TyperGroup):
    """Reports a :class:`ModrobError` in words and ends with its exit code; other exceptions are bugs."""

    def invoke(self, ctx: Any) -> Any:
        """Run the subcommand inside the boundary."""
        try:
            return super().invoke(ctx)
        except ModrobError as error:
            if ctx.params.get("debug"):
                raise
            for line in str(error).splitlines():
                typer.echo(f"error: {line}", err=True)
            raise typer.Exit(error.exit_code) from error


app = typer.Typer(
    cls=ModrobGroup,
    name="modrob",
    help="Models, torque bounds and evidence for robot arms whose dynamics are not exactly known.",
    epilog="Start with: modrob demo",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"modrob {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of reported errors too.")] = False,
) -> None:
    pass


for _module in (
    check,
    assemble,
    identify,
    validate,
    log,
    bounds,
    trajectory,
    scale,
    collision,
    simulate,
    pack,
    schema,
    init,
    demo,
):
    _module.register(app)


def main() -> None:
    """Entry point of the console script."""
    app()
