"""What reports say of drift."""

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.report.document import Picture, Section, Table, Text
from modrob_cli.workflows.fleet_time import DAY, FleetTime
from modrob_cli.workflows.fleet_trends import Measure, Series, find_trends, trend_sections


def sections(series: list[Array], relative: bool = True) -> list[Section]:
    count = len(series[0])
    when = FleetTime(1.7e9 + DAY * np.arange(float(count)), True, "day", DAY, 0)
    marked = np.zeros(count, dtype=bool)
    joints = tuple(Series(f"j{k + 1}", "N m", values, marked) for k, values in enumerate(series))
    return trend_sections("Drift", when, [Measure("Coulomb friction", joints, relative=relative)], "d")


def sentence(found: list[Section]) -> str:
    block = found[0].blocks[0]
    assert isinstance(block, Text)
    return block.text


def table(found: list[Section]) -> Table:
    block = found[1].blocks[0]
    assert isinstance(block, Table)
    return block


def test_planted_drift_with_its_slope_and_a_step() -> None:
    rng = np.random.default_rng(1)
    days = np.arange(100.0)
    still, up, down = (2.0 + 0.1 * rng.normal(size=100) for _ in range(3))
    step = np.where(days < 50, 1.0, 2.0) + 0.02 * rng.normal(size=100)
    found = sections([still, up + 0.01 * days, down - 0.01 * days, step])
    text = sentence(found)
    assert text.startswith("Over the dates of the logs: Coulomb friction of j2 rises by 0.0")
    assert "Coulomb friction of j3 falls by 0.0" in text
    assert "In steps or waves rather than steadily: Coulomb friction of j4." in text
    assert "j1" not in text
    says = [row[9] for row in table(found).rows]
    assert says == ["no drift beyond chance", "drifts", "drifts", "steps or waves"]
    _, of, logs, middle, slope, lower, upper, share, unit, _ = table(found).rows[1]
    assert (of, logs, unit) == ("Coulomb friction", 100, "N m")
    assert isinstance(slope, float)
    assert isinstance(lower, float)
    assert isinstance(upper, float)
    assert lower < 0.01 < upper
    assert abs(slope - 0.01) < 0.002
    assert share == f"{slope * 99.0 / float(np.median(up + 0.01 * days)):+.1%}"
    assert middle == float(np.median(up + 0.01 * days))


def test_waves_are_no_drift_but_said() -> None:
    rng = np.random.default_rng(3)
    found = sections([np.sin(np.arange(100.0) / 8.0) + 0.3 * rng.normal(size=100), rng.normal(size=100)])
    assert sentence(found).startswith("In steps or waves rather than steadily: Coulomb friction of j1. Other motions")
    assert [row[9] for row in table(found).rows] == ["steps or waves", "no drift beyond chance"]


def test_no_false_claim_on_noise_in_95_percent_of_tables() -> None:
    rng = np.random.default_rng(4)
    when = FleetTime(1.7e9 + DAY * np.arange(40.0), True, "day", DAY, 0)
    marked = np.zeros(40, dtype=bool)
    claims = 0
    for _ in range(100):
        measure = Measure("x", tuple(Series("j", "", rng.normal(size=40), marked) for _ in range(6)))
        claims += any(found.says != "no drift beyond chance" for found in find_trends(when, [measure])[0])
    assert claims <= 12  # 5 of 100 with a standard deviation of 2.2


def test_noise_is_no_drift() -> None:
    rng = np.random.default_rng(2)
    found = sections([rng.normal(size=50) for _ in range(6)], relative=False)
    assert sentence(found) == "Over the dates of the logs, none of 6 trends is more than chance."
    assert [row[7] for row in table(found).rows] == [None] * 6


def test_few_logs_get_a_picture_and_no_claim() -> None:
    found = sections([np.arange(5.0)])
    assert sentence(found) == "No drift is looked for: that takes at least 10 logs of different times."
    assert len(found) == 1
    assert isinstance(found[0].blocks[1], Picture)


def test_values_that_no_log_tells() -> None:
    found = sections([np.full(20, np.nan), np.arange(20.0)])
    row = table(found).rows[0]
    assert row[2:5] == (0, None, None)
    assert row[9] == "too few logs"
    assert len(sections([np.full(20, np.nan)])[0].blocks) == 1
