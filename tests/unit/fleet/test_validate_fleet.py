"""The report of many validated logs: the right figures, links, and no more than a browser can take."""

import statistics
from html.parser import HTMLParser
from typing import Any

import pytest

from modrob_cli.report.document import Link, Notes, Report, Section, Table, Text
from modrob_cli.report.render import render
from modrob_cli.workflows.validate_fleet import validation_fleet_report
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_table import validation_table
from tests.unit.fleet.synthetic import results, whole

EVIL = '<script>alert(1)</script>"&'
OPTIONS = ValidateOptions("torque", max_nrmse=0.3)


def report(logs: list[dict[str, Any]], skipped: list[dict[str, Any]] | None = None) -> Report:
    return validation_fleet_report("two", whole(logs, skipped), OPTIONS)


def section(found: Report, title: str) -> Section:
    return next(one for one in found.sections if one.title.startswith(title))


def table(found: Report, title: str) -> Table:
    block = section(found, title).blocks[0]
    assert isinstance(block, Table)
    return block


def cells(found: Table, column: str) -> list[Any]:
    place = found.header.index(column)
    return [row[place] for row in found.rows]


@pytest.fixture(scope="module")
def fleet() -> list[dict[str, Any]]:
    """120 logs: the first joint drifts; one is far out, one has no torque, one fails."""
    logs = results(120, drift=0.5)
    logs[7]["joints"][1] |= {"nrmse": 0.9, "passed": False}
    logs[7] |= {"page": "run_7.validate.html", "picture": "run_7.validate.png"}
    logs[9]["joints"][1]["nrmse"] = None
    logs[11]["joints"][0]["inside"] = 0.3
    for one in logs:
        one["joints"][0]["passed"] = True
    return logs


@pytest.fixture(scope="module")
def page(fleet: list[dict[str, Any]]) -> Report:
    return report(fleet, [{"log": "runs/bad.mcap", "reason": EVIL, "code": 3}])


def test_verdict_first_with_counts(page: Report) -> None:
    assert page.verdict.tone == "bad"
    assert "1 of 120 logs did not pass. 1 log could not be judged. The scope." in page.verdict.scope
    assert page.subtitle.startswith("120 logs, 1 more could not be judged")
    assert page.sections[0].title == "Logs that could not be judged"
    assert table(page, "Logs that could not").rows == (("runs/bad.mcap", EVIL, 3),)


def test_quartiles_of_each_joint(fleet: list[dict[str, Any]], page: Report) -> None:
    ratios = [one["joints"][1]["nrmse"] for one in fleet if one["joints"][1]["nrmse"] is not None]
    lower, middle, upper = statistics.quantiles(ratios, n=4, method="inclusive")
    found = table(page, "Joints over all logs").rows[1]
    assert found[:5] == pytest.approx(("slide", lower, middle, upper, 0.9))
    assert found[5] == Link("run_7", "run_7.validate.html")
    assert found[6] == 1  # outliers
    assert found[8:10] == (max(one["joints"][1]["max_error"] for one in fleet), "N")


def test_worst_logs_and_outliers_with_links(page: Report) -> None:
    found = table(page, "The worst logs")
    assert cells(found, "log")[:2] == [Link("run_9", "run_9.validate.json"), Link("run_7", "run_7.validate.html")]
    assert cells(found, "NRMSE")[:2] == [None, 0.9]
    assert cells(found, "picture")[:2] == [None, Link("picture", "run_7.validate.png")]
    assert cells(found, "data")[1] == Link("data", "run_7.validate.json")
    assert cells(found, "outlier by")[1] == "NRMSE of slide"
    assert found.tones[1, 3] == "bad"
    # Not among the worst ten, but listed: it stands out by what is inside.
    names = [link.text for link in cells(found, "log")]
    assert cells(found, "outlier by")[names.index("run_11")] == "inside of shoulder"
    assert cells(found, "inside, least")[names.index("run_11")] == "30.0% (shoulder)"


def test_drift_of_errors_and_of_fitted_friction(page: Report) -> None:
    said = section(page, "Drift of the errors").blocks[0]
    assert isinstance(said, Text)
    assert said.text.startswith("Over the dates of the logs: NRMSE of shoulder rises by 0.0")
    assert "slide" not in said.text
    said = section(page, "Friction fitted").blocks[0]
    assert said == Text("Over the dates of the logs, none of 6 trends is more than chance.")
    units = cells(table(page, "Friction fitted to each log, link side (modrob identify tells its intervals): "), "unit")
    assert units == ["N m s/rad", "N s/m", "N m", "N", "N m", "N"]


def test_all_logs_are_in_a_folded_table(fleet: list[dict[str, Any]], page: Report) -> None:
    found = section(page, "All logs")
    assert found.folded
    assert not found.on_paper
    rows = table(page, "All logs")
    assert len(rows.rows) == 120
    worst = rows.rows[1]
    assert worst[:3] == (Link("run_7", "run_7.validate.html"), fleet[7]["date"][:16].replace("T", " "), "failed")
    assert worst[3:5] == (fleet[7]["joints"][0]["nrmse"], 0.9)
    assert rows.tones[1, 4] == "bad"


class Links(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)


def test_page_is_repeatable_and_nothing_can_be_injected() -> None:
    logs = results(3, dated=False)
    logs[0] |= {"log": f"runs/{EVIL}", "name": EVIL.replace("/", ""), "notes": [EVIL]}
    for one in logs:
        one["joints"][0]["name"] = EVIL
    html = render(report(logs, [{"log": EVIL, "reason": EVIL, "code": 3}]))
    assert html == render(report(logs, [{"log": EVIL, "reason": EVIL, "code": 3}]))
    parser = Links()
    parser.feed(html)
    assert "script" not in parser.tags


def test_one_log_has_no_drift_section() -> None:
    titles = [one.title for one in report(results(1)).sections]
    assert titles == ["Joints over all logs", "The worst logs and the outliers", "All logs (1)"]


def test_no_log_could_be_judged() -> None:
    found = report([], [{"log": "a.mcap", "reason": "empty", "code": 3}])
    assert [one.title for one in found.sections] == ["Logs that could not be judged"]
    assert "0 logs, 1 more" in found.subtitle


def test_no_torque_in_any_log() -> None:
    logs = results(12)
    for one in logs:
        for joint in one["joints"]:
            joint["nrmse"] = None
    found = report(logs)
    assert table(found, "Joints over all logs").rows[0][1:6] == (None,) * 5
    render(found)


def test_notes_are_said_once_with_their_logs() -> None:
    logs = results(5)
    for one in logs[:4]:
        one["notes"] = ["cut off"]
    logs[4]["joints"][1]["notes"] = ["hardly moves"]
    notes = section(report(logs), "Notes").blocks[0]
    assert notes == Notes(("4 logs (run_0, run_1, run_2, ...): cut off", "run_4: slide: hardly moves"))


def test_page_of_5000_logs_is_below_5_megabytes() -> None:
    logs = results(5000)
    for one in logs:
        for joint in one["joints"]:
            del joint["fit"]
    found = report(logs)
    assert len(table(found, "All logs").rows) == 5000
    assert len(render(found).encode()) < 5e6
    assert dict(found.provenance)["5000 inputs"].startswith("sha256:")


def test_table_has_a_row_for_each_log_and_joint(fleet: list[dict[str, Any]]) -> None:
    found = validation_table(fleet)
    names = [column.name for column in found.columns]
    assert len(found.rows) == 240
    row = dict(zip(names, found.rows[15], strict=True))
    assert (row["log"], row["joint"], row["unit"], row["nrmse"], row["passed"]) == (
        "runs/run_7.mcap",
        "slide",
        "N",
        0.9,
        False,
    )
    assert (row["date"], row["viscous"], row["reflected_inertia"]) == (fleet[7]["date"], 5.0, None)
    found.columnwise()  # all values are of the types of their columns
