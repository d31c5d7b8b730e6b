"""Friction and rotor of each log's own fit over the dates of the logs, to see whether friction drifts."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.workflows.fleet_trends import Measure, Series

PARAMETERS = {
    "viscous": "viscous friction",
    "coulomb": "Coulomb friction",
    "reflected_inertia": "reflected inertia",
    "offset": "offset",
    "asymmetric": "asymmetric viscous friction",
    "stribeck": "Stribeck friction",
    "load": "load-dependent friction",
    "drive_gain": "drive gain",
}
"""Terms of fits and their names on pages; what follows from them, such as friction of one direction, is left out."""

Fit = dict[str, Any]


def parameter_measures(fits: Sequence[Sequence[Fit] | None], unit: Callable[[int, str], str]) -> list[Measure]:
    """Each parameter as a measure of all joints; parameters that no log tells are left out.

    Parameters
    ----------
    fits : of each log, a fit for each joint; None if it has none
    unit : of a parameter of the j-th joint
    """
    first = next((fit for fit in fits if fit is not None), None)
    if first is None:
        return []
    measures = []
    for key, title in PARAMETERS.items():
        series = tuple(_series(fits, j, key, joint["name"], unit(j, key)) for j, joint in enumerate(first))
        if any(np.isfinite(one.values).any() for one in series):
            measures.append(Measure(title, series, relative=key != "offset"))
    return measures


def _series(fits: Sequence[Sequence[Fit] | None], j: int, key: str, joint: str, unit: str) -> Series:
    values = _column([None if fit is None else fit[j].get(key) for fit in fits])
    intervals = [(None if fit is None else fit[j].get("interval", {}).get(key)) or (None, None) for fit in fits]
    lower, upper = _column([ends[0] for ends in intervals]), _column([ends[1] for ends in intervals])
    marked = np.zeros(len(values), dtype=bool)
    if not np.isfinite(lower).any():
        return Series(joint, unit, values, marked)
    return Series(joint, unit, values, marked, lower, upper)


def _column(values: Sequence[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def share_holding(series: Series) -> float | None:
    """Share of the logs whose interval holds the median over all logs; None where there are no intervals."""
    if series.lower is None or series.upper is None:
        return None
    there = np.isfinite(series.values) & np.isfinite(series.lower) & np.isfinite(series.upper)
    if there.sum() < 2:
        return None
    middle = np.median(series.values[there])
    return float(np.mean((series.lower[there] <= middle) & (middle <= series.upper[there])))
