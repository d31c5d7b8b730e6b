"""The HTML report of a validation."""

from collections.abc import Sequence
from typing import Any

from modrob_cli.model.robot import Robot
from modrob_cli.plot.residuals import JointResiduals, residual_figure
from modrob_cli.report.document import Block, Notes, Picture, Report, Section, Table, Text, Tone, Verdict
from modrob_cli.workflows.validate_judge import Judged, JudgedLog
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_result import failures

MOST_DRAWN = 3
"""Logs whose joints are drawn; the worst ones."""


def validation_report(
    robot: Robot,
    judged: Judged,
    results: Sequence[dict[str, Any]],
    head: dict[str, Any],
    options: ValidateOptions,
    provenance: dict[str, Any],
) -> Report:
    """The whole report: verdict and scope first, then tables, then pictures of the worst logs."""
    pairs = sorted(zip(judged.logs, results, strict=True), key=lambda pair: _worst(pair[1]), reverse=True)
    drawn = pairs[:MOST_DRAWN]
    sections = [Section("Joints over all logs", (_overview(robot, results),))]
    sections.append(Section("Logs, the worst first", tuple(_log_blocks(pairs, options))))
    for k, (log, result) in enumerate(drawn):
        sections.append(Section(f"{result['log']}: joint by joint", tuple(_pictures(robot, log, k))))
    if len(pairs) > len(drawn):
        text = f"{len(pairs) - len(drawn)} more logs are in the table; their pictures are beside this page."
        sections.append(Section("Not drawn", (Text(text),)))
    count = "1 log" if len(results) == 1 else f"{len(results)} logs"
    return Report(
        f"Validation of {robot.name}",
        f"{count}; effort is {options.effort}; friction: {judged.friction}",
        _verdict(head, options),
        tuple(sections),
        _provenance(provenance, options),
        signature=True,
    )


def _worst(result: dict[str, Any]) -> float:
    return max((joint["nrmse"] if joint["nrmse"] is not None else float("inf")) for joint in result["joints"])


def _verdict(head: dict[str, Any], options: ValidateOptions) -> Verdict:
    tones: dict[bool | None, Tone] = {True: "good", False: "bad", None: "open"}
    wanted = [f"NRMSE of every joint at most {options.max_nrmse:g}"] if options.max_nrmse is not None else []
    if options.min_inside is not None:
        wanted.append(f"at least {options.min_inside:.2%} of the samples inside the bounds")
    texts = {
        True: f"Passed: {' and '.join(wanted)}.",
        False: f"Failed: expected {' and '.join(wanted)}.",
        None: "No verdict: the logs are those that the values were fitted to."
        if wanted
        else "No verdict was asked for (--max-nrmse, --min-inside).",
    }
    return Verdict(tones[head["passed"]], texts[head["passed"]], head["scope"])


def _overview(robot: Robot, results: Sequence[dict[str, Any]]) -> Table:
    rows = []
    for j, joint in enumerate(robot.joints):
        entries = [result["joints"][j] for result in results]
        ratios = sorted(entry["nrmse"] for entry in entries if entry["nrmse"] is not None)
        middle = ratios[len(ratios) // 2] if ratios else None
        worst = max(entries, key=lambda entry: entry["max_error"])
        row = (
            joint.name,
            middle,
            ratios[-1] if ratios else None,
            max(entry["rmse"] for entry in entries),
            worst["max_error"],
            min(entry["inside"] for entry in entries),
            max(entry["mean_width"] for entry in entries),
            worst["unit"],
        )
        rows.append(row)
    header = ("joint", "NRMSE, median", "worst", "RMSE, worst", "largest error", "inside, least", "mean width", "unit")
    caption = (
        "NRMSE: RMS error / RMS of the recorded torque. Inside: fraction of samples inside the bounds of the model."
    )
    return Table(header, tuple(rows), caption)


def _log_blocks(pairs: Sequence[tuple[JudgedLog, dict[str, Any]]], options: ValidateOptions) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    notes = []
    for _, result in pairs:
        for joint in result["joints"]:
            if joint["passed"] is not None and failures(joint, options):
                tones[len(rows), 2] = "bad"
            part = (joint["nrmse"], joint["rmse"], joint["max_error"], joint["worst_time"], joint["inside"])
            rows.append((result["log"], joint["name"], *part, joint["unit"]))
            notes += [f"{result['log']}: {joint['name']}: {note}" for note in joint["notes"]]
        notes += [f"{result['log']}: {note}" for note in result["notes"]]
        if result["seconds_left_out"]:
            said = f"{result['seconds_left_out']:.4g} s were left out, because the robot file was fitted to them"
            notes.append(f"{result['log']}: {said}")
        if result["fitted_to_these_samples"]:
            notes.append(f"{result['log']}: friction was fitted to these very samples")
    header = ("log", "joint", "NRMSE", "RMSE", "largest error", "at [s]", "inside", "unit")
    blocks: list[Block] = [Table(header, tuple(rows), "", tones)]
    return [*blocks, Notes(tuple(notes))] if notes else blocks


def _pictures(robot: Robot, log: JudgedLog, k: int) -> list[Block]:
    out: list[Block] = []
    run, bounds = log.run, log.bounds
    for j, joint in enumerate(robot.joints):
        revolute = joint.type == "revolute"
        series = (run.t, run.dq[:, j], run.tau[:, j], bounds.nominal[:, j], bounds.lower[:, j], bounds.upper[:, j])
        data = JointResiduals(joint.name, "N m" if revolute else "N", "rad/s" if revolute else "m/s", *series, log.used)
        error = log.errors[j]
        ratio = "no torque recorded" if error.nrmse is None else f"NRMSE {error.nrmse:.3g}"
        worst = f"largest error {error.max_error:.3g} {data.unit} at {error.worst_time:.4g} s"
        caption = f"{joint.name}: {ratio}, {worst}; {log.inside[j]:.1%} inside. Grey: not counted."
        alternative = f"Recorded and predicted torque of {joint.name}, what is left over time, velocity and frequency"
        out.append(Picture(residual_figure(data, f"log{k}joint{j}"), caption, alternative))
    return out


def _provenance(provenance: dict[str, Any], options: ValidateOptions) -> tuple[tuple[str, str], ...]:
    rows = [("modrob", str(provenance["modrob"]))]
    rows += [(key.replace("_", " "), "-" if value is None else str(value)) for key, value in options.data.items()]
    rows += [(name, str(value)) for name, value in provenance["inputs"].items()]
    return tuple(rows)
