"""The result of an identification as plain data: verdict, joints, logs, what was left out."""

from collections.abc import Sequence
from typing import Any

from modrob_cli.batch.jobs import Outcome
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.batch_result import skipped_entries
from modrob_cli.workflows.identify_fit import Fitted, gravity_text
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_pooled import PooledRuns
from modrob_cli.workflows.identify_summary import joint_entry, prediction_entry

Entry = dict[str, Any]


def identification_result(
    robot: Robot,
    pooled: PooledRuns,
    fitted: Fitted,
    outcomes: Sequence[Outcome],
    options: IdentifyOptions,
    alone: bool,
) -> Entry:
    """Everything but the provenance.

    Parameters
    ----------
    outcomes : of all logs; those that failed are listed
    alone : each log was fitted alone too
    """
    joints = [joint_entry(robot, j, fitted, pooled.train) for j in range(robot.dof)]
    gravity = gravity_text(fitted, all(run.gravity for run in pooled.train))
    share = fitted.gravity
    return {
        "robot": robot.name,
        **_verdict(joints, gravity, fitted, options),
        "joints": joints,
        "condition": max(joint["condition"] for joint in joints),
        "samples": sum(int(run.used.sum()) for run in pooled.train),
        "samples_held_out": sum(int(run.used.sum()) for run in pooled.test),
        "gravity": None if share is None else {"share": share.value, "interval": list(share.interval)},
        "signals": {
            "cutoff": pooled.cutoff.cutoff,
            "rule": pooled.cutoff.reason,
            "bandwidth": [float(x) if x == x else None for x in pooled.cutoff.bandwidth],
        },
        "logs": [_log(robot, pooled, fitted, k, alone) for k in range(len(pooled.runs))],
        "skipped": skipped_entries(outcomes),
        "options": options.data,
    }


def _log(robot: Robot, pooled: PooledRuns, fitted: Fitted, k: int, alone: bool) -> Entry:
    item = pooled.runs[k]
    fit = {"fit": item.found.done["fit"]} if alone else {}
    return {**item.entry, "prediction": prediction_entry(robot, fitted.logs[k]), **fit}


def _verdict(joints: Sequence[Entry], gravity: str | None, fitted: Fitted, options: IdentifyOptions) -> Entry:
    """Whether the fit explains the record, on what evidence, and whether it passes ``--max-nrmse``."""
    reasons = [f"{joint['name']}: {reason}" for joint in joints for reason in joint["reasons"]]
    if gravity is not None:
        reasons.insert(0, gravity)
    passed = None
    if options.max_nrmse is not None:
        ratios = [found.error.nrmse for found in fitted.judged]
        passed = all(ratio is not None and ratio <= options.max_nrmse for ratio in ratios)
    held = f"the last {options.holdout:.0%} of each log, which the fit did not see"
    seen = "the samples that were fitted, so the errors say nothing about another log"
    return {
        "passed": passed,
        "explained": not reasons,
        "reasons": reasons,
        "scope": f"Judged on {held if fitted.test else seen}.",
    }


def badness(log: Entry) -> float:
    """How badly the pooled fit predicts a log: NRMSE of its worst joint; below all others where nothing is judged."""
    ratios = [joint["nrmse"] for joint in log["prediction"] or [] if joint["nrmse"] is not None]
    return max(ratios, default=-1.0)


def worst_first(logs: Sequence[Entry]) -> list[Entry]:
    """Logs in the order in which they deserve a look."""
    return sorted(logs, key=badness, reverse=True)
