"""The HTML report of an identification."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.model.robot import Robot
from modrob_cli.plot.friction import FrictionPanel, friction_svg
from modrob_cli.plot.residuals import JointResiduals, residual_figure
from modrob_cli.report.document import Block, Notes, Picture, Report, Section, Table, Tone, Verdict
from modrob_cli.workflows.identify_fit import Fitted, predicted, scaled
from modrob_cli.workflows.identify_fleet import identify_fleet_sections
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_pooled import PooledRun
from modrob_cli.workflows.identify_report_logs import input_rows, log_sections, skipped_section
from modrob_cli.workflows.identify_summary import UNITS, rotor_side, unit

Entry = dict[str, Any]


def identification_report(
    robot: Robot,
    item: PooledRun,
    panels: Sequence[FrictionPanel],
    fitted: Fitted,
    result: Entry,
    options: IdentifyOptions,
) -> Report:
    """Verdict and scope first, then parameters with intervals, errors, friction, drift, and what is left of one log.

    Parameters
    ----------
    item : the log that is predicted worst
    panels : friction of all joints
    """
    confidence = options.regression.confidence
    count = "1 log" if len(result["logs"]) == 1 else f"{len(result['logs'])} logs"
    left_out = f", {len(result['skipped'])} more left out" if result["skipped"] else ""
    source = item.found.job.label
    sections = [
        *skipped_section(result["skipped"]),
        Section("Parameters", tuple(_parameters(robot, result, confidence))),
        Section("How well they predict", tuple(_errors(result, fitted))),
        Section("Friction over velocity", tuple(_friction(panels))),
        *identify_fleet_sections(result["logs"]),
        Section(f"{source}: joint by joint (the log that is predicted worst)", tuple(_left(robot, item, fitted))),
        *log_sections(result),
        Section("Correlations of the estimates", tuple(_correlations(result)), folded=True),
    ]
    place = 3 if result["skipped"] else 2
    if "rigid_body" in result:
        sections.insert(place, Section("Rigid bodies", tuple(_rigid_body(result["rigid_body"]))))
    if "bounds" in result:
        sections.insert(place, Section("Intervals that hold every sample", tuple(_bounds(result["bounds"]))))
    return Report(
        f"Identification of {robot.name}",
        f"{count}{left_out}; effort is {options.effort}; intervals of {confidence:.0%}",
        _verdict(result),
        tuple(sections),
        _provenance(result),
        signature=True,
    )


def _verdict(result: Entry) -> Verdict:
    tone: Tone = "good" if result["explained"] else "bad"
    headline = "The fit explains the record." if result["explained"] else "Something is left unexplained."
    if result["passed"] is not None:
        tone = "good" if result["passed"] else "bad"
        headline = f"{'Passed' if result['passed'] else 'Failed'}: NRMSE at most {result['options']['max_nrmse']:g}."
    return Verdict(tone, headline, " ".join([result["scope"], *result["reasons"]]))


def _parameters(robot: Robot, result: Entry, confidence: float) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    for joint, entry in zip(robot.joints, result["joints"], strict=True):
        for name in UNITS:
            side = rotor_side(joint) if name == "rotor_inertia" else "joint"
            if name == "rotor_inertia" and side == "joint":
                continue  # the same as the reflected inertia
            if entry.get(name) is not None:
                low, high = entry["interval"].get(name) or (None, None)
                rows.append(
                    (joint.name, name, entry[name], entry["stderr"].get(name), low, high, unit(joint, name), side)
                )
            elif name in entry["not_excited"]:
                tones[len(rows), 2] = "open"
                said = f"not excited: {entry['not_excited'][name]}"
                rows.append((joint.name, name, None, None, None, None, unit(joint, name), said))
    header = ("joint", "parameter", "estimate", "standard error", "from", "to", "unit", "side")
    caption = f"Intervals of {confidence:.0%}; standard errors hold for correlated residuals."
    notes = tuple(f"{entry['name']}: {note}" for entry in result["joints"] for note in entry["notes"])
    blocks: list[Block] = [Table(header, tuple(rows), caption, tones)]
    return [*blocks, Notes(notes)] if notes else blocks


def _errors(result: Entry, fitted: Fitted) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    for entry in result["joints"]:
        if not entry["explained"]:
            tones[len(rows), 0] = "bad"
        row: list[Any] = [entry["name"]]
        for part in ("training", "holdout"):
            found = entry[part] or {}
            row += [found.get(key) for key in ("nrmse", "nrmse_low_passed", "rmse", "max_error")]
        rows.append((*row, entry["unit"]))
    held = ("held out: NRMSE", "below cut-off", "RMSE", "largest", "unit")
    header = ("joint", "fitted: NRMSE", "below cut-off", "RMSE", "largest", *held)
    where = "the held-out part" if fitted.test else "the fitted part; nothing was held out"
    caption = f"NRMSE: RMS error / RMS of the recorded torque. Judged on {where}."
    return [Table(header, tuple(rows), caption, tones)]


def _friction(panels: Sequence[FrictionPanel]) -> list[Block]:
    out: list[Block] = []
    for k, panel in enumerate(panels):
        alternative = f"Friction of {panel.name} over velocity: samples, fitted curve and its confidence band"
        caption = f"{panel.name}: {'; '.join(panel.captions)}"
        out.append(Picture(friction_svg(panel, f"friction{k}"), caption, alternative))
    return out


def _left(robot: Robot, item: PooledRun, fitted: Fitted) -> list[Block]:
    whole = scaled([item.whole], fitted.estimates)[0]
    torque, used = predicted(whole, fitted.estimates), item.train.used | item.test.used
    out: list[Block] = []
    for j, (joint, estimate) in enumerate(zip(robot.joints, fitted.estimates, strict=True)):
        half = 2.0 * estimate.rms
        revolute = joint.type == "revolute"
        series = (whole.t, whole.dq[:, j], whole.tau[:, j], torque[:, j], torque[:, j] - half, torque[:, j] + half)
        names = (joint.name, unit(joint, "offset"), "rad/s" if revolute else "m/s")
        held = np.flatnonzero(item.test.used)
        split = f"Held out from {whole.t[held[0]]:.4g} s on." if len(held) else "All of it was fitted."
        caption = f"{joint.name}. {split} Band: +-2 RMS of the residual. Grey: not counted."
        alternative = f"Recorded and predicted torque of {joint.name}, what is left over time, velocity and frequency"
        picture = residual_figure(JointResiduals(*names, *series, used), f"left{j}", "+-2 RMS of the residual")
        out.append(Picture(picture, caption, alternative))
    return out


def _correlations(result: Entry) -> list[Block]:
    out: list[Block] = []
    for entry in result["joints"]:
        terms, matrix = entry["correlation"]["terms"], entry["correlation"]["matrix"]
        rows = tuple((term, *(float(value) for value in row)) for term, row in zip(terms, matrix, strict=True))
        caption = f"{entry['name']}; condition number {entry['condition']:.3g}"
        out.append(Table(("", *terms), rows, caption))
    return out


def _bounds(bounds: Entry) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    keys = ("viscous", "coulomb", "reflected_inertia", "disturbance")
    for entry in bounds["joints"]:
        for key in keys:
            found = entry[key]
            rows.append((entry["name"], key, found["lower"], found["upper"]))
    widths = tuple(
        (entry["name"], entry["mean_width"], entry["mean_width_rigid"], entry["inside"], entry["unit"])
        for entry in bounds["joints"]
    )
    notes = tuple(f"{entry['name']}: {note}" for entry in bounds["joints"] for note in entry["notes"])
    return [
        Table(("joint", "parameter", "from", "to"), tuple(rows), "Link side, SI units; rounded outward."),
        Table(("joint", "mean width of the bounds", "of the rigid bodies", "samples inside", "unit"), widths),
        Notes(notes),
    ]


def _rigid_body(entry: Entry) -> list[Block]:
    suspects = tuple(item["text"] for item in entry["suspects"]) or ("No link's data stand out.",)
    rows = tuple(
        (item["name"], item["unit"], item["nominal"], item["value"], item["stderr"], item["distance"])
        for item in entry["parameters"]
        if item["rigid"]
    )
    header = ("base parameter", "unit", "robot file", "estimate", "standard error", "distance [standard errors]")
    return [Notes(suspects), Table(header, rows), Notes(tuple(entry["notes"]))]


def _provenance(result: Entry) -> tuple[tuple[str, str], ...]:
    rows = [("modrob", str(result["provenance"]["modrob"]))]
    rows += [(key.replace("_", " "), str(value)) for key, value in result["options"].items() if value is not None]
    return (*rows, *input_rows(result["provenance"]["inputs"]))
