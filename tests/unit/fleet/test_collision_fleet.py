"""The report of many logs with collision bands: the right order and figures, links, a bearable size."""

import statistics
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.model.robot import Robot
from modrob_cli.report.document import Link, Notes, Report, Section, Table, Text
from modrob_cli.report.render import render
from modrob_cli.workflows.collision_fleet import collision_fleet_report, collision_table, nearness
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_result import threshold_document
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[3]
OPTIONS = CollisionOptions("torque", ddq_tolerance=[0.5])
EVIL = '<script>alert(1)</script>"&'


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(ROOT / "assemblies" / "lwa4p-6.yaml").robot


def made_log(robot: Robot, k: int, rng: np.random.Generator, rise: float = 0.0) -> dict[str, Any]:
    """Shares of the band around 0.4, that of the first joint rising; an event wherever one is above 1."""
    shares = 0.4 * np.exp(0.2 * rng.normal(size=robot.dof)) + rise * np.eye(robot.dof)[0]
    closest: list[dict[str, Any]] = [
        {"joint": name, "share": float(share), "time": 1.5}
        for name, share in zip(robot.joint_names, shares, strict=True)
    ]
    events = [
        {"start": 1.0, "end": 1.2, "joint": joint["joint"], "side": "upper", "peak": 2.0, "unit": "N m",
         "peak_time": 1.5, "peak_effort": 2.0, "effort_unit": "N m"}
        for joint in closest if joint["share"] > 1.0
    ]  # fmt: skip
    forces = {key: {"median": 20.0 + k, "worst": None if k == 3 else 90.0} for key in ("x", "worst_direction")}
    sensitivity = [
        {"joint": name, "unit": "N m", "min_detectable": 9.0 + k, "median": 3.0 + k, "least": 1.0 + k,
         "other_band_ratio": 2.0, "shares": []}
        for name in robot.joint_names
    ]  # fmt: skip
    phase = {"samples": 10, "torque": [1.0 + k] * robot.dof, "force": [2.0 + k] * 6}
    return {
        "log": f"run_{k}", "source": f"logs/run_{k}.mcap",
        "date": f"2026-03-{1 + k % 28:02d}T10:{k // 28 % 60:02d}:00Z",
        "page": None, "picture": None, "planned": False, "duration": 8.0, "samples": 2000, "notes": ["the same note"],
        "events": events, "closest": closest, "contacts": None, "sensitivity": sensitivity,
        "methods": [{"method": "bands", "events": len(events), "false_alarms": None, "contacts": 0, "detected": 0,
                     "missed": 0}],
        "contact_forces": [{"point": "tool", **forces}], "thresholds": {"acceleration": phase, "nominal": phase},
    }  # fmt: skip


def report(robot: Robot, logs: list[dict[str, Any]], skipped: list[dict[str, Any]] | None = None) -> Report:
    inputs = {f"{log['log']}.mcap": "sha256:0" for log in logs}
    result = {
        "logs": logs, "skipped": skipped or [], "learned": None, "thresholds": threshold_document(robot, logs, OPTIONS),
        "provenance": {"modrob": "0", "inputs": inputs},
    }  # fmt: skip
    return collision_fleet_report(robot, result, OPTIONS)


def section(found: Report, title: str) -> Section:
    return next(one for one in found.sections if one.title.startswith(title))


def table(found: Report, title: str, k: int = 0) -> Table:
    block = section(found, title).blocks[k]
    assert isinstance(block, Table)
    return block


def test_logs_come_worst_first_and_lead_to_their_pages(robot: Robot) -> None:
    """Events first, even where their joint came less far; planned motions last."""
    rng = np.random.default_rng(1)
    logs = [made_log(robot, k, rng) for k in range(6)]
    logs[4] = made_log(robot, 4, rng, rise=2.0)
    logs[4]["page"] = "run_4.collision.html"
    logs[2] = {**logs[2], "events": [{**made_log(robot, 9, rng, 2.0)["events"][0]}]}
    logs[5] = {**logs[5], "planned": True, "closest": None, "events": [], "methods": [], "date": None}
    order = sorted(logs, key=lambda log: -nearness({"logs": [log]}))
    assert [log["log"] for log in order[:2]] == ["run_4", "run_2"]
    assert order[-1]["log"] == "run_5"
    found = report(robot, logs, [{"log": EVIL, "reason": "found <nothing>", "code": 3}])
    rows = table(found, "Logs, the worst first").rows
    links = [row[0] for row in rows]
    assert all(isinstance(link, Link) for link in links)
    assert [link.text for link in links if isinstance(link, Link)] == [log["log"] for log in order]
    first = links[0]
    assert isinstance(first, Link)
    assert first.href == "run_4.collision.html"
    assert rows[-1][2:7] == (None, None, None, None, None)
    assert found.verdict.tone == "bad"
    assert "2 events in 5 logs, 2 of which have any" in found.verdict.headline
    assert "1 log could not be judged" in found.verdict.headline
    page = render(found)
    assert "<script>" not in page
    assert page == render(found)


def test_figures_over_all_logs(robot: Robot) -> None:
    rng = np.random.default_rng(2)
    logs = [made_log(robot, k, rng, rise=0.8 if k == 7 else 0.0) for k in range(9)]
    found = report(robot, logs)
    near = table(found, "How near")
    shares = [log["closest"][0]["share"] for log in logs]
    row = near.rows[0]
    assert row[2] == pytest.approx(statistics.median(shares))
    assert row[4] == pytest.approx(max(shares))
    assert isinstance(row[5], Link)
    assert row[5].text == "run_7"
    assert row[6] == sum(share > 1.0 for share in shares) == 1
    felt = table(found, "What is certain")
    assert felt.rows[0][1:4] == (1.0, 7.0, 17.0)  # least of the least, median of the medians, worst of the worst
    forces = table(found, "What is certain", 1)
    assert [row[2:] for row in forces.rows] == [(24.0, None), (24.0, None)]  # no joint feels it in run_3
    assert table(found, "Constant thresholds").rows[0][1:5] == (9.0, 18.0, 9.0, 18.0)
    notes = section(found, "Notes").blocks[0]
    assert isinstance(notes, Notes)
    (note,) = notes.items
    assert note.startswith("9 logs (run_7, ")  # the worst one first
    assert note.endswith(", ...): the same note")
    data = collision_table(logs)
    assert len(data.rows) == 9 * robot.dof
    assert data.columnwise()[[column.name for column in data.columns].index("share")][:: robot.dof] == shares


def test_a_thousand_logs_make_a_page_that_opens(robot: Robot) -> None:
    """A planted drift of the first joint is named, and no other; the page stays small."""
    rng = np.random.default_rng(3)
    logs = [made_log(robot, k, rng, rise=0.3 * (k % 28) / 28.0) for k in range(1000)]
    found = report(robot, logs)
    said = section(found, "Drift of the share used").blocks[0]
    assert isinstance(said, Text)
    assert f"share used of {robot.joint_names[0]} rises by" in said.text
    assert not any(f"share used of {name} rises" in said.text for name in robot.joint_names[1:])
    assert len(table(found, "Logs, the worst first").rows) == 30
    assert len(table(found, "All logs (1000)").rows) == 1000
    assert section(found, "All logs").folded
    assert len(render(found)) < 2_500_000
