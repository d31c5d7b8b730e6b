"""What ``modrob validate`` prints."""

from typing import Any

from modrob_cli.cli.batch_end import end_batch


def measure(record: dict[str, Any]) -> tuple[float, str]:
    """How bad a log is: NRMSE of its worst joint, in words too."""
    (log,) = record["logs"]
    worst = max(log["joints"], key=lambda joint: float("inf") if joint["nrmse"] is None else joint["nrmse"])
    least = min(log["joints"], key=lambda joint: joint["inside"])
    inside = f"{least['inside']:.1%} inside ({least['name']})"
    if worst["nrmse"] is None:
        return float("inf"), f"no torque recorded in {worst['name']}, {inside}"
    return worst["nrmse"], f"NRMSE {worst['nrmse']:.3f} ({worst['name']}), {inside}"


def end(result: dict[str, Any], wanted: bool) -> None:
    """Exit code and message of a run that has results; ``wanted``: a verdict was asked for.

    Raises
    ------
    FailedLogsError
        If logs have no result, or some do not pass.
    """
    if result["passed"] is None and wanted:
        advice = "give another log, or say --accept-fitted"
        against = [f"no verdict: all samples are among those that the values were fitted to; {advice}"]
        end_batch(result["skipped"], True, against)
    end_batch(result["skipped"], result["passed"] is False, _against(result))


def _against(result: dict[str, Any]) -> list[str]:
    """What does not pass, worst first."""
    failed = [(log["log"], joint) for log in result["logs"] for joint in log["joints"] if joint["passed"] is False]
    failed.sort(key=lambda pair: pair[1]["nrmse"] or float("inf"), reverse=True)
    lines = []
    for log, joint in failed:
        ratio = "no torque recorded" if joint["nrmse"] is None else f"NRMSE {joint['nrmse']:.3f}"
        lines.append(f"{log}: {joint['name']}: {ratio}, {joint['inside']:.1%} inside the bounds")
    return lines


def say_log(log: dict[str, Any]) -> None:
    """Print the table of one log."""
    from modrob_cli.cli.console import say, table

    used = f"{log['samples_used']} of {log['samples']} samples at {log['rate']:.6g} Hz"
    say(f"{log['log']}: {used}, {log['velocity']} velocity, low-pass {log['cutoff']:.4g} Hz")
    for note in log["notes"]:
        say(f"  note: {note}")
    if log["resampled"]:
        say(f"  note: resampled, the times are not even (longest gap {log['longest_gap']:.4g} s)")
    if log["seconds_left_out"]:
        say(f"  note: {log['seconds_left_out']:.4g} s were left out, because the robot file was identified from them")
    if log["fitted_to_these_samples"]:
        say("  note: the values were fitted to these very samples")
    header = ("joint", "NRMSE", "below cut-off", "RMSE", "max error", "inside", "unit")
    keys = ("nrmse", "nrmse_low_passed", "rmse", "max_error")
    fitted = [key for key in ("viscous", "coulomb", "reflected_inertia", "offset") if "fit" in log["joints"][0]]
    rows = [
        (
            joint["name"],
            *(_short(joint[key]) for key in keys),
            f"{joint['inside']:.1%}",
            joint["unit"],
            *(_short(joint["fit"][key]) for key in fitted),
        )
        for joint in log["joints"]
    ]
    say(table((*header, *("viscous", "Coulomb", "inertia", "offset")[: len(fitted)]), rows))
    for joint in log["joints"]:
        for note in joint["notes"]:
            say(f"  note: {joint['name']}: {note}")


def _short(value: float | None) -> float | str:
    return "-" if value is None else float(f"{value:.3g}")


def say_end(result: dict[str, Any]) -> None:
    """Print what the figures mean, the verdict and the files."""
    from modrob_cli.cli.console import say

    say("  NRMSE: RMS error / RMS of the torque as recorded; below cut-off: both low-passed like the motion.")
    say("  inside: samples inside the bounds of the model, intervals of the robot file or of the fit.")
    if result["friction"] != "file":
        say("  Fitted, link side: viscous [N m s/rad], Coulomb [N m], rotor at the joint [kg m^2], offset [N m].")
    say(result["scope"])
    if result["passed"] is not None:
        say(f"Verdict: {'passed' if result['passed'] else 'failed'}")
    files = list(result["files"].values())
    for path in files[:6]:
        say(f"wrote {path}")
    if len(files) > 6:
        say(f"and {len(files) - 6} more files beside them")
