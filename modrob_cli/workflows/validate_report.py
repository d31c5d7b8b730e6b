"""The HTML page of one validated log."""

from typing import Any

from modrob_cli import __version__
from modrob_cli.model.robot import Robot
from modrob_cli.plot.residuals import JointResiduals, residual_figure
from modrob_cli.report.document import Block, Notes, Picture, Report, Section, Table, Tone, Verdict
from modrob_cli.workflows.validate_judge import JudgedLog
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_result import failures


def validation_page(
    robot: Robot,
    log: JudgedLog,
    result: dict[str, Any],
    head: dict[str, Any],
    inputs: dict[str, str],
    options: ValidateOptions,
) -> Report:
    """The page of one log: verdict and scope first, then the table of joints, then their pictures.

    Parameters
    ----------
    result, head : of the log, and what is around it in its JSON
    inputs : hash of each file that it was made from
    """
    sections = (
        Section("Joints", tuple(_log_blocks(result, options))),
        Section("Joint by joint", tuple(_pictures(robot, log))),
    )
    return Report(
        f"Validation of {robot.name}",
        f"{result['log']}; effort is {options.effort}; friction: {head['friction']}",
        verdict(head, options),
        sections,
        provenance_rows(inputs, options),
        signature=True,
    )


def verdict(head: dict[str, Any], options: ValidateOptions) -> Verdict:
    """The answer over one log or all of them; ``head`` has the keys ``passed`` and ``scope``."""
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


def _log_blocks(result: dict[str, Any], options: ValidateOptions) -> list[Block]:
    rows: list[tuple[Any, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    notes = []
    for joint in result["joints"]:
        if joint["passed"] is not None and failures(joint, options):
            tones[len(rows), 1] = "bad"
        part = (joint["nrmse"], joint["rmse"], joint["max_error"], joint["worst_time"], joint["inside"])
        rows.append((joint["name"], *part, joint["mean_width"], joint["unit"]))
        notes += [f"{joint['name']}: {note}" for note in joint["notes"]]
    notes += result["notes"]
    if result["seconds_left_out"]:
        seconds = f"{result['seconds_left_out']:.4g} s"
        notes.append(f"{seconds} were left out, because the robot file was fitted to them")
    if result["fitted_to_these_samples"]:
        notes.append("friction was fitted to these very samples")
    header = ("joint", "NRMSE", "RMSE", "largest error", "at [s]", "inside", "mean width", "unit")
    caption = (
        "NRMSE: RMS error / RMS of the recorded torque. Inside: fraction of samples inside the bounds of the model."
    )
    blocks: list[Block] = [Table(header, tuple(rows), caption, tones)]
    return [*blocks, Notes(tuple(notes))] if notes else blocks


def _pictures(robot: Robot, log: JudgedLog) -> list[Block]:
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
        out.append(Picture(residual_figure(data, f"joint{j}"), caption, alternative))
    return out


def provenance_rows(inputs: dict[str, str], options: ValidateOptions) -> tuple[tuple[str, str], ...]:
    """Version, options and hashes, as label and value."""
    rows = [("modrob", __version__)]
    rows += [(key.replace("_", " "), "-" if value is None else str(value)) for key, value in options.data.items()]
    return (*rows, *inputs.items())
