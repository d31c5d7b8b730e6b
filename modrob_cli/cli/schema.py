"""``modrob schema``: the JSON Schema of a document kind."""

from typing import Annotated

import typer

from modrob_cli.cli.console import print_json

KindName = Annotated[
    str, typer.Argument(metavar="KIND", help="module/1, assembly/1, robot/1, trajectory/1, task/1 or scenario/1.")
]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("schema", epilog="Example: modrob schema module/1 > module.schema.json")(schema)


def schema(kind: KindName) -> None:
    """Print the JSON Schema of a document kind, for editors.

    The schema covers names, types and shapes. Rules across keys (min <= nominal <= max, links and joints, known
    modules) are checked by modrob check only.
    """
    from modrob_cli.workflows import schema as workflow

    print_json(workflow.schema(kind))
