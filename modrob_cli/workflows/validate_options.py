"""What ``modrob validate`` is asked for."""

from dataclasses import dataclass, field
from typing import Any, Literal

from modrob_cli.errors import UsageError
from modrob_cli.identify.effort import EffortKind
from modrob_cli.io.log_options import LogOptions

FrictionFrom = Literal["file", "held-out", "in-sample"]
"""Where friction, rotor and offset come from: the robot file; a fit to the first part of each log, judged on the rest;
a fit to the very samples that are judged."""


@dataclass(frozen=True)
class ValidateOptions:
    """How logs are read and judged.

    Attributes
    ----------
    effort : what the logs call effort
    reading : how logs are read
    cutoff : of the low-pass, [Hz]; None: chosen from the spectrum of each log
    friction : where friction comes from; None: the file if it has any, else held-out
    holdout : share of each log at its end that a held-out fit does not see
    max_nrmse : largest NRMSE of any joint that passes; None for no such condition
    min_inside : smallest fraction of samples inside the bounds that passes; None for no such condition
    accept_fitted : give a verdict also on data that friction was fitted to
    """

    effort: EffortKind
    reading: LogOptions = field(default_factory=LogOptions)
    cutoff: float | None = None
    friction: FrictionFrom | None = None
    holdout: float = 0.4
    max_nrmse: float | None = None
    min_inside: float | None = None
    accept_fitted: bool = False

    def check(self) -> None:
        """Refuse options out of range or that contradict each other.

        Raises
        ------
        UsageError
            Saying which.
        """
        if not 0.0 < self.holdout < 1.0:
            raise UsageError(f"--holdout: found {self.holdout:g}, expected a share between 0 and 1, such as 0.4")
        if self.min_inside is not None and not 0.0 < self.min_inside <= 1.0:
            raise UsageError(f"--min-inside: found {self.min_inside:g}, expected a fraction up to 1, such as 0.95")
        if self.friction == "in-sample" and self.wants_verdict and not self.accept_fitted:
            raise UsageError(
                "--friction in-sample with --max-nrmse or --min-inside would call a fit validated on the data it was "
                "fitted to; use --friction held-out, or say --accept-fitted"
            )

    @property
    def wants_verdict(self) -> bool:
        """Whether there is any condition to pass."""
        return self.max_nrmse is not None or self.min_inside is not None

    @property
    def data(self) -> dict[str, Any]:
        """For the result."""
        return {
            "effort": self.effort,
            "topic": self.reading.topic,
            "cutoff": self.cutoff,
            "friction": self.friction,
            "holdout": self.holdout,
            "max_nrmse": self.max_nrmse,
            "min_inside": self.min_inside,
            "accept_fitted": self.accept_fitted,
        }
