"""Pictures of many logs: whole, repeatable, of a size that does not follow the number of logs."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.plot.fleet import SpreadPanel, spread_figure, swarm
from modrob_cli.plot.fleet_trend import Line, TimeAxis, TrendPanel, trend_figure, view

EVIL = "<script>$x & y"


def spreads(count: int) -> str:
    rng = np.random.default_rng(count)
    values = tuple(np.exp(rng.normal(size=count)) for _ in range(2))
    marked = tuple(x > 5.0 for x in values)
    panels = [SpreadPanel("NRMSE", values, marked, True, 0.35), SpreadPanel(EVIL, values, marked)]
    return spread_figure(["joint", EVIL], panels, "spread")


def trends(count: int, dated: bool = True) -> str:
    rng = np.random.default_rng(count)
    t = np.sort(rng.uniform(1.7e9, 1.73e9, count)) if dated else np.arange(1.0, count + 1.0)
    panels = []
    for title in ("joint", EVIL, "none"):
        y = rng.normal(size=count) if title != "none" else np.full(count, np.nan)
        line = Line(float(np.median(t)), 0.0, 1e-9, -1e-9, 2e-9, title == EVIL) if count >= 10 else None
        panels.append(TrendPanel(title, EVIL, y, y - 0.2, y + 0.2, y > 2.0, line))
    return trend_figure(TimeAxis(t, dated, EVIL), panels, EVIL, "trend", limit=1.0)


@pytest.mark.parametrize("count", [1, 2, 40, 5000])
def test_pictures_are_whole_repeatable_and_not_large(count: int) -> None:
    for draw in (spreads, trends):
        svg = draw(count)
        ElementTree.fromstring(svg)
        assert "<script>" not in svg
        assert svg == draw(count)
        assert "currentColor" in svg
        assert len(svg) < 600_000


def test_dots_of_few_logs_are_shapes_and_of_many_a_bitmap() -> None:
    assert "data:image/png" not in trends(100)
    assert len(re.findall("<use", trends(100))) >= 200
    assert "data:image/png" in trends(2000)


def test_axes_say_dates_or_numbers() -> None:
    assert re.search(r">20\d\d-\d\d-\d\d<", trends(40))
    assert not re.search(r">20\d\d-\d\d-\d\d<", trends(40, dated=False))


def test_panel_without_a_value_says_so() -> None:
    assert "no log tells it" in trends(3)


@pytest.mark.parametrize("x", [np.zeros(1), np.zeros(5000), np.linspace(0.0, 1.0, 700), np.arange(3.0) / 3.0])
def test_swarm_stays_in_its_row(x: Array) -> None:
    offsets = swarm(x, (0.0, 1.0))
    assert np.abs(offsets).max() <= 0.36 + 1e-12
    if len(x) <= 3:
        assert not offsets.any()  # dots far apart stay on the line
    # No two dots of one place cover each other.
    assert len(np.unique(np.column_stack([x, offsets]), axis=0)) == len(x)


def test_view_shows_all_but_what_lies_far_out() -> None:
    y = np.random.default_rng(1).normal(size=100)
    low, high = view(y)
    assert low < y.min()
    assert high > y.max()
    far = view(np.append(y, [1000.0]))
    assert far[1] < 10.0
    assert view(np.array([1.0, 1000.0]))[1] > 1000.0  # of a few nothing is left out
    assert view(y, limit=4.0)[1] > 4.0
    assert view(y, limit=400.0) == view(y)  # a limit far away would flatten the rest
    low, high = view(np.full(5, 2.0))
    assert (low, high) == pytest.approx((1.99, 2.01))  # rounding must not look like drift
