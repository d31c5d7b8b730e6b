"""What ``modrob identify`` is asked for."""

from dataclasses import dataclass, field
from typing import Any

from modrob_cli.errors import UsageError
from modrob_cli.identify.effort import EffortKind
from modrob_cli.identify.friction_terms import FrictionModel
from modrob_cli.identify.regression import RegressionOptions
from modrob_cli.io.log_options import LogOptions
from modrob_cli.workflows.bounded_options import BoundedOptions


@dataclass(frozen=True)
class IdentifyOptions:
    """How logs are read, fitted and judged.

    Attributes
    ----------
    effort : what the logs call effort
    reading : how logs are read
    cutoff : of the low-pass, [Hz]; None: chosen from the spectra
    holdout : share of each log at its end that the fit does not see, 0 to below 1
    regression : friction terms, confidence, robustness
    max_nrmse : largest NRMSE of any joint that passes; None for no verdict
    fit_per_log : also fit each of several logs alone
    bounds : also find the intervals that hold every sample; None: no
    rigid_body : also estimate base parameters
    """

    effort: EffortKind
    reading: LogOptions = field(default_factory=LogOptions)
    cutoff: float | None = None
    holdout: float = 0.4
    regression: RegressionOptions = field(default_factory=RegressionOptions)
    max_nrmse: float | None = None
    fit_per_log: bool = True
    bounds: BoundedOptions | None = None
    rigid_body: bool = False

    def check(self) -> None:
        """Refuse options out of range or that contradict each other.

        Raises
        ------
        UsageError
            Saying which.
        """
        if not 0.0 <= self.holdout < 1.0:
            raise UsageError(f"--holdout: found {self.holdout:g}, expected a share from 0 to less than 1, such as 0.4")
        if not 0.0 < self.regression.confidence < 1.0:
            found = self.regression.confidence
            raise UsageError(f"--confidence: found {found:g}, expected more than 0 and less than 1, such as 0.95")
        if self.regression.drive_gain and self.effort != "current":
            raise UsageError("--drive-gain estimates joint torque per ampere; it needs --effort current")
        if self.regression.drive_gain and (self.bounds is not None or self.rigid_body):
            raise UsageError("--drive-gain cannot be combined with --bounds or --rigid-body: identify the gain first")

    @property
    def recorded(self) -> EffortKind:
        """What the effort is taken for; with an unknown drive gain it is fitted in its own units, as if torque."""
        return "torque" if self.regression.drive_gain else self.effort

    @property
    def data(self) -> dict[str, Any]:
        """For the result."""
        fit = self.regression
        return {
            "effort": self.effort,
            "topic": self.reading.topic,
            "cutoff": self.cutoff,
            "holdout": self.holdout,
            "friction": fit.model.kinds,
            "confidence": fit.confidence,
            "robust": fit.robust,
            "offset_per_log": fit.offset_per_log,
            "drive_gain": fit.drive_gain,
            "max_nrmse": self.max_nrmse,
        }


def regression_options(
    friction: str, confidence: float, robust: bool, offset_per_log: bool, drive_gain: bool
) -> RegressionOptions:
    """Options of the fit, ``friction`` as text; raises as :meth:`FrictionModel.parse`."""
    return RegressionOptions(FrictionModel.parse(friction), confidence, robust, offset_per_log, drive_gain)
