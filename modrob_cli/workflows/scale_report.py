"""The HTML report of a scaled motion."""

from typing import Any

from modrob_cli.plot.scale import factor_svg, torque_svg
from modrob_cli.report.document import Block, Notes, Picture, Report, Section, Table, Text, Verdict
from modrob_cli.workflows.scale_pictures import ScaleViews
from modrob_cli.workflows.scale_problem import LIMITED, ScaleProblem
from modrob_cli.workflows.scale_words import unit_of

_METHODS = {
    "nominal": "nominal parameters, nothing uncertain: not safe for other members of the box",
    "exact": "exact range over all admissible parameters",
    "ianea": "published interval algorithm (IANEA*), all limits treated soundly",
    "published_rule": "published interval algorithm and published rule: not safe where viscous friction brakes a joint",
}


def scale_report(problem: ScaleProblem, result: dict[str, Any], views: ScaleViews) -> Report:
    """The whole report: answer and scope first, then what decides, pictures, limits."""
    sections = [Section("What decides", tuple(_decides(result)))]
    map_words = (
        "Red: some admissible parameters exceed a limit at that time and factor. Green: the factors that are safe all "
        "along, and the one that was chosen."
    )
    drawn = factor_svg(views.factors, result["certified_factor"] or result["factor"], "factors")
    sections.append(Section("Safe factors over time", (Picture(drawn, map_words, "Map of factors over time"),)))
    torque_words = "Band: all admissible parameters; line: nominal; dashed: limits that are near; red: beyond a limit."
    drawn = torque_svg(views.torques, "torques")
    sections.append(Section("Torques before and after", (Picture(drawn, torque_words, "Torques of all joints"),)))
    sections.append(Section("Other ways to bound the torques", (_compared(result),)))
    sections.append(Section("Limits that count", (_limits(problem),), folded=True))
    if result["warnings"]:
        sections.insert(1, Section("Warnings", (Notes(tuple(result["warnings"])),)))
    return Report(
        f"Scaling of {result['trajectory']} for {result['robot']}",
        f"method {result['method']}, {result['samples']} samples",
        _verdict(result),
        tuple(sections),
        _provenance(result),
        signature=True,
    )


def _verdict(result: dict[str, Any]) -> Verdict:
    if not result["feasible"]:
        return Verdict("bad", "No factor is safe.", result["explanation"])
    certified = result["certified_factor"]
    used = certified if certified is not None else result["factor"]
    times = f"{result['duration']:.6g} s become {result['new_duration']:.6g} s"
    if certified is not None:
        scope = (
            "Proven for every time of the motion and every admissible parameter of the robot's file, by "
            f"{result['cells']} cells of time; the certificate can be checked with modrob scale --verify."
        )
        return Verdict("good", f"Safe up to {used:.6g} times as fast, proven: {times}.", scope)
    scope = (
        f"At {result['samples']} samples, for every admissible parameter. Nothing is proven between them (--certify)."
    )
    if result["method"] == "nominal":
        scope = f"At {result['samples']} samples, for nominal parameters only: other admissible ones may break limits."
    return Verdict("good", f"Safe up to {used:.6g} times as fast: {times}.", scope)


def _decides(result: dict[str, Any]) -> list[Block]:
    critical = result["critical"]
    if critical is None:
        text = result["explanation"] or "No limit: the largest factor that was asked for is safe."
        return [Text(text)]
    blocks: list[Block] = [Text(f"{critical['message']}.")]
    rows = [(part["parameter"], part["width"], part["share"]) for part in critical["parameters"]]
    if rows:
        caption = (
            "Width of this joint's torque at that instant by each uncertain parameter alone: what to measure better."
        )
        blocks.append(Table(("parameter", f"width [{critical['unit']}]", "share"), tuple(rows), caption))
    if result["gaps"]:
        parts = ", ".join(f"{low:.6g} to {high:.6g}" for low, high in result["gaps"])
        blocks.append(Text(f"Not every smaller factor is safe: {parts} break a limit."))
    return blocks


def _compared(result: dict[str, Any]) -> Table:
    rows = []
    for name, words in _METHODS.items():
        factor = result["compared"].get(name)
        rows.append((words, factor, result["duration"] / factor if factor else None))
    return Table(("torques", "factor", "duration [s]"), tuple(rows), "Factors at the samples, with the same limits.")


def _limits(problem: ScaleProblem) -> Table:
    rows = []
    for j, joint in enumerate(problem.robot.joints):
        for name in LIMITED:
            item = getattr(joint.limits, name)
            if item is not None:
                rows.append(
                    (joint.name, name, item[0], item[1], "A" if name == "current" else unit_of(problem.robot, j, name))
                )
    return Table(
        ("joint", "quantity", "lower", "upper", "unit"), tuple(rows), "Of the robot's file and the command line."
    )


def _provenance(result: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    source = result["provenance"]
    rows = [("modrob", str(source["modrob"]))]
    rows += [(key.replace("_", " "), str(value)) for key, value in result["options"].items() if value not in (None, {})]
    rows += [(name, str(value)) for name, value in source["inputs"].items()]
    return tuple(rows)
