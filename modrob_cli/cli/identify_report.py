"""What ``modrob identify`` tells people."""

from typing import Any

from modrob_cli.cli.batch_end import end_batch
from modrob_cli.cli.bounded_report import say_bounds
from modrob_cli.cli.console import say, table

_MAIN = (("viscous", "viscous"), ("coulomb", "Coulomb"), ("reflected_inertia", "rotor"), ("offset", "offset"))
_DIRECTIONS = ("coulomb_forward", "coulomb_backward", "viscous_forward", "viscous_backward")
_MORE = (*_DIRECTIONS, "load", "stribeck", "stribeck_velocity", "transition_width", "drive_gain")
_MOST_LOGS = 12


def say_result(result: dict[str, Any]) -> None:
    """Print verdict and scope, then parameters, errors, logs, notes and files."""
    say(f"{result['robot']}: {_verdict(result)}")
    for reason in result["reasons"]:
        say(f"  - {reason}")
    say(f"  {result['scope']}")
    say(f"  {result['samples']} samples fitted, {result['samples_held_out']} held out, {_counts(result)}")
    signals = result["signals"]
    say(f"  low-pass {signals['cutoff']:.4g} Hz: {signals['rule']}\n")
    _say_parameters(result)
    _say_errors(result)
    _say_logs(result)
    _say_notes(result)
    if "bounds" in result:
        say_bounds(result["bounds"])
    _say_rigid_body(result)
    say("")
    _say_files(result)


def _say_files(result: dict[str, Any]) -> None:
    """Paths of what was written; those of single logs are counted only."""
    records = {f"{log['name']}.identify.json" for log in result["logs"]}
    for kind, path in result["files"].items():
        if kind not in records:
            say(f"wrote {path}")
    if records & set(result["files"]):
        say(f"wrote the fit of each log: LOG.identify.json, {len(records)} files")


def _counts(result: dict[str, Any]) -> str:
    left_out = f", {len(result['skipped'])} left out" if result["skipped"] else ""
    return f"{len(result['logs'])} log(s){left_out}"


def end(result: dict[str, Any]) -> None:
    """Exit code and message of a run that has results.

    Raises
    ------
    FailedLogsError
        If logs are left out, or ``--max-nrmse`` is exceeded.
    """
    limit = result["options"]["max_nrmse"]
    negative = result["passed"] is False
    against = [f"the NRMSE of at least one joint is above the {limit:g} of --max-nrmse"] if negative else []
    end_batch(result["skipped"], negative, against)


def _verdict(result: dict[str, Any]) -> str:
    if result["passed"] is not None:
        return "verdict: passed" if result["passed"] else "verdict: failed"
    if result["explained"]:
        return "verdict: the model explains the recorded torque"
    return "verdict: no, the model does not explain the recorded torque of all joints"


def _say_parameters(result: dict[str, Any]) -> None:
    confidence = result["options"]["confidence"]
    rows = []
    for joint in result["joints"]:
        cells: list[object] = [joint["name"]]
        for key, _ in _MAIN:
            cells.append(_with_interval(joint, key))
        rows.append((*cells, "yes" if joint["explained"] else "NO", _figure(joint["condition"])))
    header = ("joint", *(title for _, title in _MAIN), "explained", "condition")
    say(table(header, rows))
    say(
        f"  value +- half of the {confidence:.0%} interval, all at the joint: viscous [N m s/rad], Coulomb [N m], rotor"
    )
    say("  inertia times gear ratio squared [kg m^2], offset [N m]; prismatic joints [N s/m, N, kg, N]\n")
    more = [(joint, key) for joint in result["joints"] for key in _MORE if key in joint["interval"]]
    if more:
        say(
            table(("joint", "parameter", "value"), [(j["name"], key, _with_interval(j, key)) for j, key in more]) + "\n"
        )


def _with_interval(joint: dict[str, Any], key: str) -> str:
    value = joint.get(key)
    if value is None:
        return "not excited" if key in joint["not_excited"] else "-"
    ends = joint["interval"].get(key)
    mark = "" if joint["physical"] or value >= 0.0 or key == "offset" else " (!)"
    return f"{value:.4g} +-{0.5 * (ends[1] - ends[0]):.2g}{mark}" if ends else f"{value:.4g}{mark}"


def _say_errors(result: dict[str, Any]) -> None:
    rows = []
    for joint in result["joints"]:
        cells: list[object] = [joint["name"]]
        for part in ("training", "holdout"):
            found = joint[part]
            keys = ("nrmse", "nrmse_low_passed", "rmse", "max_error")
            cells += ["-"] * 4 if found is None else [_figure(found[key]) for key in keys]
        rows.append((*cells, joint["unit"]))
    header = (
        "joint",
        "NRMSE fit",
        "below cut-off",
        "RMSE",
        "max",
        "NRMSE held out",
        "below cut-off",
        "RMSE",
        "max",
        "unit",
    )
    say(table(header, rows))
    say("  NRMSE: RMS error / RMS of the recorded torque; below cut-off: both low-passed\n")


def _say_logs(result: dict[str, Any]) -> None:
    from modrob_cli.workflows.identify_result import worst_first

    logs = result["logs"]
    if len(logs) < 2:
        return
    names = [joint["name"] for joint in result["joints"]]
    rows = []
    for log in worst_first(logs)[:_MOST_LOGS]:
        ratios = [_figure(joint["nrmse"]) for joint in log["prediction"] or []]
        rows.append((log["log"], f"{log['duration']:.4g}", *(ratios or ["-"] * len(names))))
    more = f", the worst {_MOST_LOGS} of {len(logs)}" if len(logs) > _MOST_LOGS else ""
    say(f"  NRMSE of the pooled fit log by log{more} (the fit of each alone is in the JSON and CSV files)\n")
    say(table(("log", "s", *names), rows) + "\n")


def _say_notes(result: dict[str, Any]) -> None:
    for joint in result["joints"]:
        absent = {key: why for key, why in joint["not_excited"].items() if key != "rotor_inertia"}
        for key, reason in absent.items():
            say(f"  note: {joint['name']}: {key} not excited: {reason}")
        for key, value in joint["kept_from_robot"].items():
            say(f"  note: {joint['name']}: {key} {value:.4g} kept from the robot file")
        for note in joint["notes"]:
            say(f"  note: {joint['name']}: {note}")
    if len(result["logs"]) == 1:
        for note in result["logs"][0]["notes"]:
            say(f"  note: {note}")


def _say_rigid_body(result: dict[str, Any]) -> None:
    if "rigid_body" not in result:
        return
    found = result["rigid_body"]
    say(f"\n  rigid bodies: {found['count']} base parameters, condition {_figure(found['condition'])}")
    if not found["suspects"]:
        say("  no link's data stand out as wrong")
    for item in found["suspects"]:
        say(f"  - {item['text']}")
    for note in found["notes"]:
        say(f"  note: {note}")


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
