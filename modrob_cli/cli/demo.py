"""``modrob demo``."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from modrob_cli.cli import collision_report, identify_report, scale, simulate, validate_report
from modrob_cli.cli.assemble import show_robot, summary_table
from modrob_cli.cli.bounds import say_result
from modrob_cli.cli.check import summary_line
from modrob_cli.cli.console import say, table
from modrob_cli.cli.options import OutDir, Overwrite

if TYPE_CHECKING:
    from modrob_cli.workflows.assemble import AssembledRobot
    from modrob_cli.workflows.demo import DemoResult

_DEFAULT = Path("out/demo")


def demo(out: OutDir = _DEFAULT, overwrite: Overwrite = False) -> None:
    """Run the whole chain on the shipped example, from the catalogue to a validated model."""
    from modrob_cli.workflows import demo as workflow

    result = workflow.demo(out, overwrite, announce=lambda step: say(f"\n{step}"))
    _report(result, workflow.MAIN_ROBOT, workflow.UNCERTAIN_ROBOT)


def _report(result: "DemoResult", main: str, uncertain: str) -> None:
    from modrob_cli.workflows import demo as workflow

    say(f"\nThe catalogue: {summary_line(result.checked)}")
    for warned in result.checked.warnings:
        say(f"  {Path(warned.fault.file).name}: {warned.fault.path}: {warned.fault.message}")
    say("\nThe arms:")
    say(summary_table(result.robots))
    say("\nThe 6-axis arm of the dissertation's Table 3.4:")
    show_robot(result.robot(main))
    say(f"\nThe same arm with 5 % on every module ({uncertain}): how wide its link parameters are, and how much wider")
    say("the published interval synthesis makes them (1 = as tight as can be):\n")
    say(_widening(result.robot(uncertain)))
    say("\nThe torques of the arm along Table B.1 of the dissertation, for every last link of")
    say("1.5 to 3 kg that its file admits (the published motion is slightly too fast for one joint):\n")
    say_result(result.bounds)
    say("\nThe arm follows the same motion with a payload of 2 kg that its controller does not know of:")
    simulate.say_result(result.simulated)
    say("\nThe log against the model without the payload: a misfit beyond the noise shows that something is missing.\n")
    for log in result.validated["logs"]:
        validate_report.say_log(log)
    say("\nAnother arm, whose true parameters differ from its file by up to 5 %: identified from one run,")
    say("validated with another motion:\n")
    identify_report.say_result(result.identified)
    for log in result.held_out["logs"]:
        validate_report.say_log(log)
    say(f"Verdict: {'passed' if result.held_out['passed'] else 'failed'} (NRMSE of every joint at most 0.3)")
    say("\nHow fast the motion of the scaling paper may be run, for every last link of 1.5 to 3 kg:")
    scale.say_result(result.scaled)
    say("\nAn arm of which friction, masses and inertias are known to intervals only: a run without contact, and one")
    say("with a hit at 2 s and a push at 15 s:")
    for log in result.collision["logs"]:
        collision_report.say_log(log, workflow.collision_options())
    say(f"\nEverything is in {result.folder}/; {result.folder}/README.md says what each file is.")
    say(f"Look at {result.folder}/pose/{main}.png, the pictures in bounds/ and simulated/, and *.html first.")


def _widening(robot: "AssembledRobot") -> str:
    """Table of tight widths and the factor of the published form, per link."""
    tables = robot.tables
    rows = []
    for i, joint in enumerate(tables.robot.joints):
        row: list[object] = [joint.name]
        for tight, published in tables.widths(i):
            row.append("exact" if tight == 0.0 else f"{tight:.3g} (x {published / tight:.2f})")
        rows.append(row)
    header = ("joint", "mass [kg]", "com, widest [m]", "inertia, widest [kg m^2]")
    return table(header, rows)


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("demo", epilog="Example: modrob demo -o out/demo")(demo)
