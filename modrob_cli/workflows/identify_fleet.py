"""What the fits of many logs, each alone, say together: how parameters spread, and whether they drift."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from modrob_cli.io.table_writer import Column, DataTable
from modrob_cli.report.document import Cell, Section, Table, Tone
from modrob_cli.workflows.fleet_parameters import parameter_measures, share_holding
from modrob_cli.workflows.fleet_statistics import FEWEST, spread
from modrob_cli.workflows.fleet_time import fleet_time
from modrob_cli.workflows.fleet_trends import Measure, trend_sections
from modrob_cli.workflows.identify_summary import UNITS

Entry = dict[str, Any]

FEW_HOLD = 0.8
"""Of intervals of 95 %, so few hold the median only if the logs differ by more than their own errors."""
_CAPTION = (
    "Own interval: median width of the intervals of single logs. Where far fewer of them hold the median over all logs "
    "than their confidence promises, the logs differ by more than their own errors: friction drifts or depends on "
    "temperature, load or speed, or the model leaves out something that depends on the motion."
)


def identify_fleet_sections(entries: Sequence[Entry]) -> list[Section]:
    """Sections of a report: drift of each parameter over the dates of the logs, and their spread.

    Parameters
    ----------
    entries : of each log: ``log``, ``date`` and ``fit``, the parameters of each joint as ``modrob identify`` gives
        them; ``fit`` is None where a log has no fit of its own

    Returns
    -------
    sections : none if fewer than two logs have a fit
    """
    fits = [entry.get("fit") for entry in entries]
    known = [fit for fit in fits if fit is not None]
    if len(known) < 2:
        return []
    measures = parameter_measures(fits, lambda j, name: _unit(known[0][j], name))
    if not measures:
        return []
    when = fleet_time([entry.get("date") for entry in entries])
    sections = trend_sections("Does friction drift? Each log's own fit", when, measures, "own")
    return [*sections, Section("Spread of the logs' own fits", (_spreads(measures),), folded=True)]


def _unit(fit: Entry, name: str) -> str:
    """Unit of a parameter; a rotor at the joint itself has that of the reflected inertia."""
    key = "reflected_inertia" if name == "rotor_inertia" and fit.get("rotor_inertia_side") == "joint" else name
    return UNITS[key][1 if fit.get("type") == "prismatic" else 0]


def _spreads(measures: Sequence[Measure]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    for measure in measures:
        for series in measure.series:
            found = spread(series.values)
            if found is None:
                continue
            width = None
            if series.lower is not None and series.upper is not None:
                width = float(np.nanmedian(series.upper - series.lower))
            holding = share_holding(series)
            if holding is not None and holding < FEW_HOLD and found.count >= FEWEST:
                tones[len(rows), 9] = "open"
            quartiles = (found.least, found.lower, found.median, found.upper, found.largest)
            held = None if holding is None else f"{holding:.0%}"
            rows.append((series.joint, measure.name, found.count, *quartiles, width, held, series.unit))
    header = ("joint", "parameter", "logs", "least", "lower quartile", "median", "upper quartile", "largest")
    return Table(
        (*header, "own interval, width", "intervals that hold the median", "unit"), tuple(rows), _CAPTION, tones
    )


def identify_table(entries: Sequence[Entry]) -> DataTable:
    """A row for each log, joint and parameter of the logs' own fits; entries as above."""
    texts = ("joint", "parameter", "unit", "side")
    numbers = ("value", "stderr", "lower", "upper")
    columns = [Column("log", "text"), Column("date", "date"), *(Column(name, "text") for name in texts)]
    columns += [*(Column(name, "number") for name in numbers), Column("verdict", "text")]
    rows = [
        (entry["log"], entry.get("date"), joint["name"], *row)
        for entry in entries
        for joint in entry.get("fit") or []
        for row in _rows(joint)
    ]
    return DataTable(tuple(columns), tuple(rows))


def _rows(fit: Entry) -> Iterator[tuple[Any, ...]]:
    """Parameters that a fit tells, and those that its motion does not tell."""
    for name in UNITS:
        side = fit["rotor_inertia_side"] if name == "rotor_inertia" else "joint"
        if fit.get(name) is not None:
            lower, upper = fit["interval"].get(name) or (None, None)
            yield name, _unit(fit, name), side, fit[name], fit["stderr"].get(name), lower, upper, "estimated"
        elif name in fit["not_excited"]:
            reason = f"not excited: {fit['not_excited'][name]}"
            yield name, _unit(fit, name), side, None, None, None, None, reason
