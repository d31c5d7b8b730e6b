"""The HTML report on one log or planned motion."""

from typing import Any

from modrob_cli.model.robot import Robot
from modrob_cli.plot.collision import CollisionPicture, ForceCurves, collision_svg, force_svg
from modrob_cli.report.document import Block, Notes, Picture, Report, Section, Table
from modrob_cli.workflows.collision_blocks import (
    collision_verdict,
    event_blocks,
    method_blocks,
    option_rows,
    threshold_table,
)
from modrob_cli.workflows.collision_judge import FORCE_SAMPLES, JudgedRun
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_result import threshold_document

_NAMES = {"x": "along x", "y": "along y", "z": "along z"}


def collision_page(
    judged: JudgedRun,
    picture: CollisionPicture,
    record: dict[str, Any],
    inputs: dict[str, str],
    options: CollisionOptions,
    version: str,
) -> Report:
    """The whole report: verdict and scope, events, methods side by side, sensitivity, thresholds, picture.

    Parameters
    ----------
    record : of the log;  inputs : hash of each file
    """
    robot: Robot = judged.about.robot
    name, results = judged.about.name, record["logs"]
    sections = [Section("Events", tuple(event_blocks(results)))]
    if judged.methods:
        sections.append(Section("Methods side by side", tuple(method_blocks(results, record))))
    sections.append(Section("What is certain to be found", tuple(_sensitivity(judged, results[0], options))))
    document = threshold_document(robot, results, options)
    sections.append(Section("Constant thresholds for controllers", (threshold_table(document),)))
    words = f"Measured torque of {name} in its band, joint by joint"
    drawn = Picture(collision_svg(picture, "log"), "Filtered measurement and band.", words)
    sections.append(Section(name, (drawn, *_notes(results[0]))))
    rows = [("modrob", version), *option_rows(options), ("samples of contact forces", f"up to {FORCE_SAMPLES}")]
    return Report(
        f"Collision thresholds of {robot.name}",
        f"{name}; filter {options.filter}; {options.method} bands",
        collision_verdict(results),
        tuple(sections),
        (*rows, *inputs.items()),
        signature=True,
    )


def _sensitivity(judged: JudgedRun, result: dict[str, Any], options: CollisionOptions) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    closest = result["closest"] or [{"share": None}] * judged.about.robot.dof
    for joint, near in zip(result["sensitivity"], closest, strict=True):
        worst = joint["shares"][0] if joint["shares"] else None
        costs = "-" if worst is None else f"{worst['parameter']} ({worst['share']:.0%})"
        figures = (joint["least"], joint["median"], joint["min_detectable"], joint["other_band_ratio"])
        rows.append((joint["joint"], *figures, joint["unit"], costs, near["share"]))
    names = ("least", "median", "worst", "other band is wider by", "unit", "costs most", "share of the band used")
    caption = (
        "External joint torque that is certain to be found (width of the filtered band) along the motion. Share used: "
        "how near the measurement came, 0 in the middle of the band, 1 at its end."
    )
    blocks: list[Block] = [Table(("joint", *names), tuple(rows), caption)]
    rows = [
        (point["point"], _NAMES.get(key, key.replace("_", " ")), figures["median"], figures["worst"])
        for point in result["contact_forces"]
        for key, figures in point.items()
        if key != "point"
    ]
    caption = "Smallest contact force that is certain to be found, base frame; –: no joint feels it."
    blocks.append(Table(("point", "direction", "median [N]", "worst [N]"), tuple(rows), caption))
    for k, (point, forces) in enumerate(zip(options.link_points(judged.about.robot), judged.forces, strict=True)):
        curves = ForceCurves(point.label, judged.picked, forces.axes, forces.easiest, forces.hardest)
        words = f"Smallest contact force at {point.label} that is certain to be found over time"
        blocks.append(Picture(force_svg(curves, f"force{k}"), words + ".", words))
    return blocks


def _notes(result: dict[str, Any]) -> tuple[Block, ...]:
    return (Notes(tuple(result["notes"])),) if result["notes"] else ()
