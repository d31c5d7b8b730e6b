"""Dates of logs, or their order."""

import numpy as np

from modrob_cli.workflows.fleet_time import fleet_time

MARCH = [f"2026-03-{day:02}T10:00:00Z" for day in range(1, 31)]


def test_dates() -> None:
    when = fleet_time(MARCH[:3])
    assert when.dated
    assert np.diff(when.values).tolist() == [86400.0, 86400.0]
    assert (when.unit, when.step, when.label) == ("day", 86400.0, "date of the log, UTC")


def test_unit_follows_from_the_span() -> None:
    assert fleet_time(["2025-01-01T00:00:00Z", "2026-01-01T00:00:00Z"]).unit == "year"
    assert fleet_time(["2026-01-01T10:00:00Z", "2026-01-01T12:00:00Z"]).unit == "hour"


def test_order_where_there_are_no_dates_or_all_are_the_same() -> None:
    cases: dict[str, list[str | None]] = {
        "the logs have no dates": [None] * 4,
        "all dates are the same": [MARCH[0]] * 4,
        "few logs have dates": [MARCH[0], None, None, None],
    }
    for reason, dates in cases.items():
        when = fleet_time(dates)
        assert not when.dated
        assert when.values.tolist() == [1.0, 2.0, 3.0, 4.0]
        assert f"in the order given ({reason})" in when.label
        assert when.undated == 0
    assert fleet_time([]).values.tolist() == []


def test_dates_of_some_logs_leave_the_others_out_and_say_so() -> None:
    when = fleet_time([*MARCH[:12], *[None] * 100])  # enough for a trend
    assert when.dated
    assert np.isnan(when.values).sum() == when.undated == 100
    assert "(100 logs without date are left out)" in when.label
