"""``modrob assemble``."""

import enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modrob_cli.cli.console import print_json, say, table
from modrob_cli.cli.options import DEFAULT_OUT, AsJson, OutDir, Overwrite, numbers

if TYPE_CHECKING:
    from modrob_cli.workflows.assemble import AssembledRobot

_FULL_REPORTS = 5


class Picture(enum.StrEnum):
    """Formats of the picture."""

    svg = "svg"
    png = "png"
    none = "none"


def assemble(
    assemblies: Annotated[list[Path], typer.Argument(metavar="ASSEMBLY...", help="Assemblies, robot files or URDFs.")],
    out: OutDir = DEFAULT_OUT,
    q: Annotated[
        str | None, typer.Option(metavar="Q1,Q2,...", help="Joint positions of the picture, e.g. 0,-pi/4,90deg.")
    ] = None,
    picture: Annotated[Picture, typer.Option(help="Format of the picture.")] = Picture.svg,
    as_json: AsJson = False,
    overwrite: Overwrite = False,
) -> None:
    """Build robots from modules: robot file, D-H, dynamic and interval tables, URDF, picture."""
    from modrob_cli.workflows import assemble as workflow

    robots = workflow.assemble(assemblies, out, numbers(q, "--q"), picture.value, overwrite)
    if as_json:
        print_json({"robots": [robot.to_json() for robot in robots]})
        return
    for robot in robots if len(robots) <= _FULL_REPORTS else []:
        show_robot(robot)
    if len(robots) > _FULL_REPORTS:
        say(summary_table(robots))
    say(f"\n{len(robots)} robot{'s' if len(robots) > 1 else ''} written to {out}/")


def summary_table(robots: list["AssembledRobot"]) -> str:
    """One line per robot."""
    rows = [(r.tables.robot.name, r.tables.robot.dof, float(r.tables.links.mass.sum())) for r in robots]
    return table(("robot", "joints", "moving mass [kg]"), rows)


def show_robot(robot: "AssembledRobot") -> None:
    """Print the tables of one robot for people: noise below 1e-12 as zero, inertia in 1e-3 kg m^2."""
    tables = robot.tables
    links, tight = tables.links, tables.tight
    say(f"\n{tables.robot.name}: {tables.robot.dof} joints, {links.mass.sum():.4g} kg moving")
    say("\n  extended D-H parameters at q = 0 [m, rad]")
    rows = [[_clean(value) for value in row] for row in tables.dh_rows()]
    say(table(("joint", "type", "a", "alpha", "d", "theta", "gamma", "p", "n"), rows, indent="    "))
    say("\n  link parameters in the D-H frames [kg, m, 1e-3 kg m^2 about the centre of mass]")
    header = ("joint", "mass", "com x", "com y", "com z", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
    body = [
        [joint.name, *map(_clean, [float(links.mass[i]), *links.com[i], *(1e3 * links.inertia_com[i])])]
        for i, joint in enumerate(tables.robot.joints)
    ]
    say(table(header, body, indent="    "))
    factor = tables.widening()
    if factor is None:
        say("\n  all link parameters are exact")
    else:
        say("\n  tight bounds of the uncertain links (published interval synthesis: median width x "
            f"{factor:.2f}; all in the intervals table)")  # fmt: skip
        bounds = [
            [joint.name, *(_range(part[i]) for part in (tight.mass, *(tight.com[:, k] for k in range(3))))]
            for i, joint in enumerate(tables.robot.joints)
            if tight.mass.wid[i] > 1e-9 or (tight.com.wid[i] > 1e-9).any()
        ]
        say(table(("joint", "mass [kg]", "com x [m]", "com y [m]", "com z [m]"), bounds, indent="    "))
    say("")
    for kind, path in robot.files.items():
        say(f"  {kind:9} {path}")


def _clean(value: object) -> object:
    """Show rounding noise as zero."""
    if isinstance(value, float):
        return 0.0 if abs(value) < 1e-12 else float(value)
    return value


def _range(interval: object) -> str:
    low, high = float(interval.inf), float(interval.sup)  # type: ignore[attr-defined]
    return f"{_clean(low):.4g} .. {_clean(high):.4g}"


def register(app: typer.Typer) -> None:
    """Add the command."""
    example = "Example: modrob assemble assemblies/lwa4p-6.yaml -o out --q 0,-pi/4,pi/2,0,pi/4,0"
    app.command("assemble", epilog=example, no_args_is_help=True)(assemble)
