"""Over what a fleet's values are drawn: the dates of the logs, or their order where they have none."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.workflows.fleet_statistics import FEWEST

DAY = 86400.0
YEAR = 365.25 * DAY
_LONG, _SHORT = 180.0 * DAY, 2.0 * DAY


@dataclass(frozen=True)
class FleetTime:
    """Times of logs.

    Attributes
    ----------
    values : [s] since 1970, or the number of the log, from 1; nan where a log has no date, shape (N,)
    dated : whether they are dates
    unit : what a slope is given per
    step : that unit, as a multiple of that of the values
    undated : logs that have no date although others do
    reason : why they are not dates
    """

    values: Array
    dated: bool
    unit: str
    step: float
    undated: int
    reason: str = ""

    @property
    def label(self) -> str:
        """What the axis says."""
        if not self.dated:
            return f"number of the log, in the order given ({self.reason})"
        left = f" ({self.undated} logs without date are left out)" if self.undated else ""
        return f"date of the log, UTC{left}"

    @property
    def over(self) -> str:
        """For sentences: over the dates, over the order."""
        return "the dates of the logs" if self.dated else "the order in which the logs were given"


def fleet_time(dates: Sequence[str | None]) -> FleetTime:
    """Dates if most logs, or enough for a trend, have them and they differ; else the order of the logs.

    Parameters
    ----------
    dates : ISO 8601 with zone; None where a log tells no date
    """
    seconds = np.array([np.nan if date is None else datetime.fromisoformat(date).timestamp() for date in dates])
    known = seconds[np.isfinite(seconds)]
    reason = ""
    if not len(known):
        reason = "the logs have no dates"
    elif len(known) < min(FEWEST, (len(dates) + 1) // 2):
        reason = "few logs have dates"
    elif known.min() == known.max():
        reason = "all dates are the same"
    if reason:
        return FleetTime(np.arange(1.0, len(dates) + 1.0), False, "100 logs", 100.0, 0, reason)
    span = float(known.max() - known.min())
    unit, step = ("year", YEAR) if span >= _LONG else ("day", DAY) if span >= _SHORT else ("hour", 3600.0)
    return FleetTime(seconds, True, unit, step, len(dates) - len(known))
