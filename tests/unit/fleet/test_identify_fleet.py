"""Fits of many logs, each alone: drift with intervals, spread, and a table."""

from typing import Any

import numpy as np

from modrob_cli.io.table_writer import csv_table, parquet_table
from modrob_cli.report.document import Picture, Table, Text
from modrob_cli.workflows.identify_fleet import identify_fleet_sections, identify_table


def entries(count: int, drift: float = 0.0, scatter: float = 0.1) -> list[dict[str, Any]]:
    """Logs whose Coulomb friction scatters, with intervals for a standard error of 0.1; viscous friction drifts."""
    rng = np.random.default_rng(count)
    out = []
    for k in range(count):
        joints = []
        for name, kind in (("hinge", "revolute"), ("slide", "prismatic")):
            values = {
                "viscous": 5.0 + drift * k + 0.1 * float(rng.normal()),
                "coulomb": 2.0 + scatter * float(rng.normal()),
                "offset": None,
                "reflected_inertia": None,
                "rotor_inertia": None,
            }
            told = [key for key, value in values.items() if value is not None]
            more = {
                "rotor_inertia_side": "motor",
                "stderr": dict.fromkeys(told, 0.1),
                "interval": {key: [values[key] - 0.196, values[key] + 0.196] for key in told},  # type: ignore[operator]
                "not_excited": {"reflected_inertia": "no acceleration", "rotor_inertia": "no acceleration"},
            }
            joints.append({"name": name, "type": kind, **values, **more})
        date = f"2026-{1 + k // 28:02}-{1 + k % 28:02}T08:00:00Z"
        out.append({"log": f"run{k}.mcap", "date": date, "fit": joints})
    return out


def test_planted_drift_is_told_with_pictures_of_the_intervals() -> None:
    logs = entries(60, drift=0.01)
    logs[5]["fit"] = None
    sections = identify_fleet_sections(logs)
    said, *pictures = sections[0].blocks
    assert isinstance(said, Text)
    assert "viscous friction of hinge rises by 0.0" in said.text
    assert "viscous friction of slide rises by 0.0" in said.text
    assert "Coulomb" not in said.text
    assert len(pictures) == 2  # what no log tells is left out
    assert isinstance(pictures[0], Picture)
    assert "bars: its interval" in pictures[0].caption
    assert "N m s/rad or N s/m" in pictures[0].svg
    slopes = sections[1].blocks[0]
    assert isinstance(slopes, Table)
    assert [row[8] for row in slopes.rows] == ["N m s/rad", "N s/m", "N m", "N"]
    assert slopes.rows[0][2] == 59


def test_spread_beyond_the_logs_own_intervals_is_marked() -> None:
    for scatter, marked in ((0.1, False), (0.5, True)):
        spread = identify_fleet_sections(entries(80, scatter=scatter))[-1].blocks[0]
        assert isinstance(spread, Table)
        row = next(row for row in spread.rows if row[:2] == ("hinge", "Coulomb friction"))
        assert row[8] is not None
        assert abs(float(str(row[8])) - 0.392) < 1e-9  # width of the own interval
        holding = float(str(row[9]).rstrip("%")) / 100.0
        # Normal distribution: 95 % within 1.96 and 30 % within 0.392 standard deviations; 80 logs.
        assert abs(holding - (0.30 if marked else 0.95)) < 0.13
        assert ((spread.rows.index(row), 9) in spread.tones) == marked


def test_nothing_to_tell_of_one_fit() -> None:
    logs = entries(3)
    logs[0]["fit"] = logs[1]["fit"] = None
    assert identify_fleet_sections(logs) == []
    assert identify_fleet_sections([]) == []


def test_table_of_parameters() -> None:
    logs = entries(2)
    logs[1] |= {"fit": None, "date": None}
    table = identify_table(logs)
    assert [column.name for column in table.columns] == [
        *("log", "date", "joint", "parameter", "unit", "side", "value", "stderr", "lower", "upper", "verdict")
    ]
    rows = {(row[2], row[3]): row for row in table.rows}
    assert len(rows) == len(table.rows) == 8
    value = logs[0]["fit"][1]["viscous"]
    assert rows["slide", "viscous"] == (
        *("run0.mcap", "2026-01-01T08:00:00Z", "slide", "viscous", "N s/m", "joint"),
        *(value, 0.1, value - 0.196, value + 0.196, "estimated"),
    )
    assert rows["hinge", "rotor_inertia"][5:] == ("motor", None, None, None, None, "not excited: no acceleration")
    assert csv_table(table).count("\n") == 9
    assert parquet_table(table)[:4] == b"PAR1"
