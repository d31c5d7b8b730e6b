"""What was found about a long log as plain data: that of any log, and its stretches."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.long_run import LongRun
from modrob_cli.identify.prediction import PredictionError
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.io.long_log import LongLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.log_date import log_date
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_result import joint_entry


@dataclass(frozen=True)
class Stretch:
    """Samples of a log that count and follow one another, and how well they are predicted; n joints.

    Attributes
    ----------
    start, end : first and last of them, [s];  samples : how many
    rmse, size : RMS error and RMS of the recorded torque, shape (n,), [N m] or [N]
    inside : samples inside the bounds, shape (n,);  width : sum of the widths of the bounds, shape (n,)
    """

    start: float
    end: float
    samples: int
    rmse: Array
    size: Array
    inside: Array
    width: Array

    @property
    def nrmse(self) -> Array:
        """RMS error by RMS torque, shape (n,); nan where no torque was recorded."""
        return np.asarray(self.rmse / np.where(self.size > 0.0, self.size, np.nan))

    @property
    def worst(self) -> float:
        """NRMSE of the worst joint; infinite where no torque was recorded."""
        return float(np.max(np.nan_to_num(self.nrmse, nan=np.inf)))

    def data(self, robot: Robot) -> dict[str, Any]:
        """For the result."""
        ratios = [None if np.isnan(ratio) else float(ratio) for ratio in self.nrmse]
        joints = [
            {
                "name": joint.name,
                "nrmse": ratios[j],
                "rmse": float(self.rmse[j]),
                "inside": float(self.inside[j] / self.samples),
            }
            for j, joint in enumerate(robot.joints)
        ]
        return {"start": self.start, "end": self.end, "samples": self.samples, "joints": joints}


@dataclass(frozen=True)
class LongJudged:
    """A long log that was judged.

    Attributes
    ----------
    errors : over all stretches, per joint
    fitted, excluded, estimates : as for :class:`modrob_cli.workflows.validate_judge.JudgedLog`
    notes : what was found in the log and what was done with it
    """

    log: LongLog
    run: LongRun
    errors: list[PredictionError]
    stretches: list[Stretch]
    fitted: bool
    excluded: float
    estimates: list[JointEstimate] | None
    notes: tuple[str, ...]


def long_result(robot: Robot, source: str, judged: LongJudged, options: ValidateOptions) -> dict[str, Any]:
    """Everything about one long log; ``source`` is its path or URL as it was given."""
    log, known, stretches = judged.log, judged.run.known, judged.stretches
    samples = sum(stretch.samples for stretch in stretches)
    inside = np.sum([stretch.inside for stretch in stretches], axis=0) / samples
    width = np.sum([stretch.width for stretch in stretches], axis=0) / samples
    joints = []
    for j in range(robot.dof):
        figures = {**asdict(judged.errors[j]), "inside": float(inside[j]), "mean_width": float(width[j])}
        estimate = None if judged.estimates is None else judged.estimates[j]
        joints.append(joint_entry(robot.joints[j], figures, estimate, judged.fitted, options))
    return {
        "log": source,
        "date": log_date(log.start),
        "joints": joints,
        "duration": log.duration,
        "samples": log.count,
        "samples_used": samples,
        "fitted_to_these_samples": judged.fitted,
        "seconds_left_out": judged.excluded,
        "repeated_stamps": log.repeated,
        "notes": list(judged.notes),
        "rate": known.rate,
        "resampled": known.resampled,
        "longest_gap": known.gap,
        "cutoff": judged.run.motion.cutoff,
        "velocity": "recorded" if log.has_velocity else "differentiated",
        "effort": options.effort,
        "stretches": [stretch.data(robot) for stretch in stretches],
    }
