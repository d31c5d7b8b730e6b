"""Whether values drift over the dates of the logs: tables, sentences and pictures for reports."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.plot.fleet_trend import Line, TimeAxis, TrendPanel, trend_figure
from modrob_cli.report.document import Block, Cell, Picture, Section, Table, Text, Tone
from modrob_cli.workflows.fleet_statistics import FEWEST, Flags, Trend, significant, trend
from modrob_cli.workflows.fleet_time import FleetTime

STEADY, UNSTEADY, NONE, FEW = "drifts", "steps or waves", "no drift beyond chance", "too few logs"
MOST_SAID = 8

METHOD = (
    "Slope: median over all pairs of logs (Theil-Sen), with its 95 % interval. A drift is claimed where Kendall's test "
    "finds one at 5 % for all rows of the table together (Holm). Steps or waves: logs in a row are more "
    "alike than by chance, or too alike for a steady drift."
)
CAVEAT = "Other motions, loads or temperatures at other times look the same."


@dataclass(frozen=True)
class Series:
    """One value of one joint over all logs, N of them.

    Attributes
    ----------
    values : nan where a log has none
    lower, upper : interval of each; None if there is none
    marked : outliers
    """

    joint: str
    unit: str
    values: Array
    marked: Flags
    lower: Array | None = None
    upper: Array | None = None


@dataclass(frozen=True)
class Measure:
    """What is looked at for all joints.

    Attributes
    ----------
    name : what its axis says
    limit : drawn as a line
    relative : whether a change as a part of the median means anything
    """

    name: str
    series: tuple[Series, ...]
    limit: float | None = None
    relative: bool = True


@dataclass(frozen=True)
class Found:
    """A trend and what it says: one of the constants above."""

    trend: Trend | None
    says: str


def find_trends(when: FleetTime, measures: Sequence[Measure]) -> list[list[Found]]:
    """Trend of every joint of every measure; what is called significant is so for all of them together."""
    trends = [trend(when.values, series.values) for measure in measures for series in measure.series]
    known = [found for found in trends if found is not None]
    # A change that is no steady drift shows as a trend of the plain test, or in logs in a row that are alike.
    moves = iter(significant([min(1.0, 2.0 * min(found.p, found.p_likeness)) for found in known]))
    steady = iter(significant([found.p_alike for found in known]))
    out = []
    for found in trends:
        if found is None:
            out.append(Found(None, FEW))
        else:
            moving, drifting = next(moves), next(steady)
            # Where half of the logs do not move at all, there is no slope to speak of.
            sloping = drifting and found.slope != 0.0
            out.append(Found(found, STEADY if sloping else UNSTEADY if moving or drifting else NONE))
    left = iter(out)
    return [[next(left) for _ in measure.series] for measure in measures]


def trend_sections(title: str, when: FleetTime, measures: Sequence[Measure], name: str) -> list[Section]:
    """What is said, with a picture for each measure; all slopes in a folded section. ``name`` is unique on the page."""
    found = find_trends(when, measures)
    blocks: list[Block] = [Text(_sentence(when, measures, found))]
    for k, measure in enumerate(measures):
        if any(np.isfinite(series.values).any() for series in measure.series):
            blocks.append(_picture(when, measure, found[k], f"{name}{k}"))
    sections = [Section(title, tuple(blocks))]
    if any(one.trend is not None for row in found for one in row):
        sections.append(Section(f"{title}: all slopes", (_table(when, measures, found),), folded=True))
    return sections


def _sentence(when: FleetTime, measures: Sequence[Measure], found: Sequence[Sequence[Found]]) -> str:
    """What the whole table says."""
    count = sum(one.trend is not None for row in found for one in row)
    if not count:
        return f"No drift is looked for: that takes at least {FEWEST} logs of different times."
    drifts: list[str] = []
    others: list[str] = []
    for measure, row in zip(measures, found, strict=True):
        pairs = list(zip(measure.series, row, strict=True))
        for series, one in pairs:
            if one.says == STEADY and one.trend is not None:
                sign = "rises" if one.trend.slope > 0.0 else "falls"
                change = f"{sign} by {abs(one.trend.slope) * when.step:.3g} per {when.unit}"
                drifts.append(f"{measure.name} of {series.joint} {change}")
        unsteady = [series.joint for series, one in pairs if one.says == UNSTEADY]
        others += [f"{measure.name} of {_listed(unsteady)}"] if unsteady else []
    parts = [f"Over {when.over}: {_listed(drifts)}."] if drifts else []
    parts += [f"In steps or waves rather than steadily: {'; '.join(others)}."] if others else []
    return " ".join([*parts, CAVEAT]) if parts else f"Over {when.over}, none of {count} trends is more than chance."


def _listed(texts: Sequence[str]) -> str:
    left = len(texts) - MOST_SAID
    return ", ".join(texts[:MOST_SAID]) + (f", and {left} more" if left > 0 else "")


def _table(when: FleetTime, measures: Sequence[Measure], found: Sequence[Sequence[Found]]) -> Table:
    span = float(np.nanmax(when.values) - np.nanmin(when.values))
    rows: list[tuple[Cell, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    for measure, row in zip(measures, found, strict=True):
        for series, one in zip(measure.series, row, strict=True):
            known = series.values[np.isfinite(series.values)]
            head: tuple[Cell, ...] = (series.joint, measure.name, len(known))
            middle = float(np.median(known)) if len(known) else None
            if one.trend is None:
                rows.append((*head, middle, None, None, None, None, series.unit or None, one.says))
                continue
            found_here = one.trend
            ends = (found_here.slope, found_here.lower, found_here.upper)
            share = _share(found_here.slope * span, middle) if measure.relative else None
            tones.update({(len(rows), 9): "open"} if one.says in (STEADY, UNSTEADY) else {})
            rows.append((*head, middle, *(end * when.step for end in ends), share, series.unit or None, one.says))
    change = f"change per {when.unit}"
    header = ("joint", "of", "logs", "median", change, "from", "to", "over all the time", "unit", "says")
    return Table(header, tuple(rows), METHOD, tones)


def _share(change: float, middle: float | None) -> str | None:
    """Change over all the time as a part of the median."""
    return None if not middle else f"{change / abs(middle):+.1%}"


def _picture(when: FleetTime, measure: Measure, found: Sequence[Found], name: str) -> Picture:
    axis = TimeAxis(when.values, when.dated, when.label)
    panels = [_panel(when, series, one) for series, one in zip(measure.series, found, strict=True)]
    units = " or ".join(dict.fromkeys(series.unit for series in measure.series if series.unit))
    label = f"{measure.name} [{units}]" if units else measure.name
    words = f"{measure.name} of each log over {when.over}, joint by joint"
    bars = "; bars: its interval" if any(series.lower is not None for series in measure.series) else ""
    caption = (
        f"{words[0].upper()}{words[1:]}. Dots: a log{bars}; red: outliers, triangles lie beyond the axis. Squares: "
        "medians of as many logs each. Line and band: slope with its 95 % interval, dashed and grey where it is no "
        "more than chance."
    )
    return Picture(trend_figure(axis, panels, label, name, measure.limit), caption, words)


def _panel(when: FleetTime, series: Series, one: Found) -> TrendPanel:
    line, text = None, "" if one.says == FEW else one.says
    if one.trend is not None:
        found = one.trend
        line = Line(found.time, found.value, found.slope, found.lower, found.upper, one.says == STEADY)
        if one.says == STEADY:
            text = f"{found.slope * when.step:+.3g} per {when.unit}"
    return TrendPanel(series.joint, text, series.values, series.lower, series.upper, series.marked, line)
