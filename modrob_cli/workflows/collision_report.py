"""The HTML report on collision thresholds."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.effort import effort_factors
from modrob_cli.model.robot import Robot
from modrob_cli.plot.collision import CollisionPicture, ForceCurves, collision_svg, force_svg
from modrob_cli.report.document import Block, Notes, Picture, Report, Section, Table, Text, Tone, Verdict
from modrob_cli.workflows.collision_judge import FORCE_SAMPLES, JudgedRun
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_result import METHODS, SCOPE, effort_unit

MOST_DRAWN = 4
MOST_EVENTS = 200
_NAMES = {"x": "along x", "y": "along y", "z": "along z"}


def collision_report(
    robot: Robot,
    judged: Sequence[JudgedRun],
    results: Sequence[dict[str, Any]],
    head: dict[str, Any],
    document: dict[str, Any],
    options: CollisionOptions,
    provenance: dict[str, Any],
) -> Report:
    """The whole report: verdict and scope, events, methods side by side, sensitivity, thresholds, pictures."""
    sections = [Section("Events", tuple(_events(results)))]
    if any(result["methods"] for result in results):
        sections.append(Section("Methods side by side", tuple(_methods(results, head))))
    sections.append(Section("What is certain to be found", tuple(_sensitivity(robot, judged, results, options))))
    sections.append(Section("Constant thresholds for controllers", (_thresholds(document),)))
    order = sorted(range(len(judged)), key=lambda k: -len(results[k]["events"]))[:MOST_DRAWN]
    for k in order:
        picture = collision_picture(judged[k], options)
        words = f"Measured torque of {judged[k].run.name} in its band, joint by joint"
        drawn = Picture(collision_svg(picture, f"log{k}"), "Filtered measurement and band.", words)
        sections.append(Section(judged[k].run.name, (drawn, *_notes(results[k]))))
    if len(judged) > len(order):
        text = f"{len(judged) - len(order)} more logs are in the tables; their pictures are beside this page."
        sections.append(Section("Not drawn", (Text(text),)))
    subtitle = f"{len(judged)} motion{'s' if len(judged) != 1 else ''}; filter {options.filter}; {options.method} bands"
    verdict = collision_verdict(results)
    rows = _provenance(provenance, options)
    return Report(f"Collision thresholds of {robot.name}", subtitle, verdict, tuple(sections), rows, signature=True)


def collision_verdict(results: Sequence[dict[str, Any]]) -> Verdict:
    """What was found, in a sentence."""
    logs = [result for result in results if not result["planned"]]
    events = sum(len(result["events"]) for result in logs)
    if not logs:
        return Verdict("open", "Thresholds of planned motions; nothing was measured.", SCOPE)
    known = [contact for result in logs for contact in result["contacts"] or ()]
    tone: Tone = "bad" if events else "good"
    if not events and not known:
        return Verdict(tone, "No collision: the measured torque never left its band.", SCOPE)
    found = sum(contact["delays"]["bands"] is not None for contact in known)
    alarms = sum(result["methods"][0]["false_alarms"] or 0 for result in logs)
    text = (
        f"{'Collision' if events else 'No collision'} found: {_count(events, 'event')} in {_count(len(logs), 'log')}."
    )
    labelled = any(result["contacts"] is not None for result in logs)
    text += f" Of {len(known)} known contacts {found} were found; {alarms} false alarms." if labelled else ""
    return Verdict(tone, text, SCOPE)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")


def collision_picture(judged: JudgedRun, options: CollisionOptions) -> CollisionPicture:
    """Bands over time in the unit of the log."""
    run, band = judged.run, judged.band
    robot = run.robot
    factors = effort_factors(robot, options.effort)
    wider: tuple[Array, Array] | None = None
    if judged.other is not None:
        wider = (judged.other.lower / factors, judged.other.upper / factors)
    names = ("exact band", "IANEA band")
    legends = ("measured, filtered", *(names if options.method == "exact" else names[::-1]))
    events = judged.methods[0].events if judged.methods else []
    return CollisionPicture(
        f"{robot.name}: {run.name}",
        f"filter {options.filter}; acceleration {run.source}",
        run.motion.t,
        None if run.tau is None else band.measured / factors,
        band.lower / factors,
        band.upper / factors,
        wider,
        robot.joint_names,
        tuple(effort_unit(robot, j, options) for j in range(robot.dof)),
        legends,
        [(event.start, event.end, event.joint) for event in events],
        [(contact.start, contact.end) for contact in run.contacts or ()],
    )


def _events(results: Sequence[dict[str, Any]]) -> list[Block]:
    rows = [
        (result["log"], event["start"], event["end"], event["joint"], event["side"], event["peak"], event["unit"])
        for result in results
        for event in result["events"]
    ]
    if not rows:
        return [Text("None.")]
    header = ("log", "start [s]", "end [s]", "joint", "side", "peak beyond the band", "unit")
    left = f"{len(rows) - MOST_EVENTS} more are in the CSV file." if len(rows) > MOST_EVENTS else ""
    return [Table(header, tuple(rows[:MOST_EVENTS]), left)]


def _methods(results: Sequence[dict[str, Any]], head: dict[str, Any]) -> list[Block]:
    names = list(dict.fromkeys(method["method"] for result in results for method in result["methods"]))
    rows = []
    for name in names:
        found = [method for result in results for method in result["methods"] if method["method"] == name]
        known = [one for one in found if one["false_alarms"] is not None]
        delays = [
            contact["delays"][name]
            for result in results
            for contact in result["contacts"] or ()
            if contact["delays"][name] is not None
        ]
        alarms = sum(one["false_alarms"] for one in known) if known else None
        middle = float(np.median(delays)) if delays else None
        totals = [sum(one[key] for one in found) for key in ("events", "contacts", "detected", "missed")]
        rows.append((METHODS[name], totals[0], alarms, *totals[1:], middle))
    header = ("method", "events", "false alarms", "known contacts", "found", "missed", "median delay [s]")
    blocks: list[Block] = [
        Table(header, tuple(rows), "False alarms: in logs that tell about contacts (or their lack).")
    ]
    learned = head["learned"]
    if learned is None:
        return [*blocks, Text("Constant thresholds and the momentum observer need logs without contact (--train).")]
    text = f"Learned from {', '.join(learned['logs'])} with a margin of {learned['margin']:.0%}; "
    return [*blocks, Text(f"{text}gain of the observer {learned['observer']['gain']:g} 1/s.")]


def _sensitivity(
    robot: Robot, judged: Sequence[JudgedRun], results: Sequence[dict[str, Any]], options: CollisionOptions
) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    for result in results:
        for joint in result["sensitivity"]:
            worst = joint["shares"][0] if joint["shares"] else None
            costs = "-" if worst is None else f"{worst['parameter']} ({worst['share']:.0%})"
            figures = (joint["least"], joint["median"], joint["min_detectable"], joint["other_band_ratio"])
            rows.append((result["log"], joint["joint"], *figures, joint["unit"], costs))
    header = ("log", "joint", "least", "median", "worst", "other band is wider by", "unit", "costs most")
    caption = "External joint torque that is certain to be found (width of the filtered band) along the motion."
    blocks: list[Block] = [Table(header, tuple(rows), caption)]
    rows = []
    for result in results:
        for point in result["contact_forces"]:
            for key, figures in point.items():
                if key != "point":
                    name = _NAMES.get(key, key.replace("_", " "))
                    rows.append((result["log"], point["point"], name, figures["median"], figures["worst"]))
    caption = "Smallest contact force that is certain to be found, base frame; –: no joint feels it."
    blocks.append(Table(("log", "point", "direction", "median [N]", "worst [N]"), tuple(rows), caption))
    one = judged[0]
    t = _picked_times(one)
    for k, (point, forces) in enumerate(zip(options.link_points(robot), one.forces, strict=True)):
        curves = ForceCurves(f"{one.run.name}: {point.label}", t, forces.axes, forces.easiest, forces.hardest)
        words = f"Smallest contact force at {point.label} that is certain to be found over time"
        blocks.append(Picture(force_svg(curves, f"force{k}"), words + ".", words))
    return blocks


def _picked_times(judged: JudgedRun) -> Array:
    """Times at which contact forces were looked at."""
    return judged.run.motion.t[judged.picked]


def _thresholds(document: dict[str, Any]) -> Table:
    request = document["request"]
    rows = []
    for kind, names in (("torque", document["joints"]), ("force", ["Fx", "Fy", "Fz", "Mx", "My", "Mz"])):
        for j, name in enumerate(names):
            keys = (
                f"{end}_{kind}_thresholds_{phase}"
                for phase in ("acceleration", "nominal")
                for end in ("lower", "upper")
            )
            rows.append((name, *(request[key][j] for key in keys), document["units"][kind][j]))
    header = ("joint", "acceleration, lower", "upper", "constant velocity, lower", "upper", "unit")
    return Table(header, tuple(rows), document["description"])


def _notes(result: dict[str, Any]) -> tuple[Block, ...]:
    return (Notes(tuple(result["notes"])),) if result["notes"] else ()


def _provenance(provenance: dict[str, Any], options: CollisionOptions) -> tuple[tuple[str, str], ...]:
    rows = [("modrob", str(provenance["modrob"]))]
    rows += [(key.replace("_", " "), "-" if value in (None, []) else str(value)) for key, value in options.data.items()]
    rows += [("samples of contact forces", f"up to {FORCE_SAMPLES}")]
    return (*rows, *((name, str(value)) for name, value in provenance["inputs"].items()))
