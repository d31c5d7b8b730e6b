"""``modrob collision`` over many logs, and over long ones."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
import yaml
from mcap.reader import make_reader
from typer.testing import Result

from modrob_cli.io.mcap_reader import read_recording
from modrob_cli.workflows.collision_load import open_run

Modrob = Callable[..., Result]

ARM = Path(__file__).parents[2] / "assemblies" / "lwa4p-table34-friction.yaml"
NAME = "lwa4p-table34-friction.collision"
STATED = ("--effort", "current", "--ddq-tolerance", "3", "--dq-noise", "1e-4", "--effort-noise", "0.05")
QUICK = (*STATED, "--skip", "0.2", "--no-compare", "--details", "0")


@pytest.fixture(scope="module")
def fleet(hit_logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with four logs, two of which are the same, a planned motion beside it, and two that are damaged."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "motion.yaml").write_bytes((hit_logs / "motion.yaml").read_bytes())
    (folder / "logs" / "day2").mkdir(parents=True)
    for name, source in (("a", "clean"), ("b", "pushed"), ("day2/a", "pushed")):
        (folder / "logs" / f"{name}.mcap").write_bytes((hit_logs / f"{source}.mcap").read_bytes())
    (folder / "logs" / "cut.mcap").write_bytes((hit_logs / "clean.mcap").read_bytes()[:3000])
    (folder / "logs" / "junk.mcap").write_bytes(b"nonsense")
    return folder


def files_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".")}


def test_bad_logs_do_not_stop_the_others(modrob: Modrob, fleet: Path) -> None:
    """Events count less than files that cannot be read; the same bytes with one process and two, and resumed."""
    command = ("collision", ARM, fleet / "logs", fleet / "motion.yaml", *QUICK, "--fail-on-collision", "--json")
    one = modrob(*command, "-j", "1", "-o", fleet / "one")
    assert one.exit_code == 3, one.output
    data = json.loads(one.stdout)
    assert [entry["code"] for entry in data["skipped"]] == [3, 3]
    assert [Path(entry["log"]).name for entry in data["skipped"]] == ["cut.mcap", "junk.mcap"]
    assert [log["log"] for log in data["logs"]] == ["a", "b", "a-2", "motion"]
    assert [bool(log["events"]) for log in data["logs"]] == [False, True, True, False]
    assert data["logs"][1]["events"] == data["logs"][2]["events"]
    assert data["collision"] is True
    assert "junk.mcap" in one.stderr
    assert "collision: b: " in one.stderr
    assert modrob(*command, "-j", "2", "-o", fleet / "two").exit_code == 3
    assert files_of(fleet / "one") == files_of(fleet / "two")
    # As if the run had been stopped: one record is missing, one file has changed.
    (fleet / "two" / "a.collision.json").unlink()
    (fleet / "two" / "b.collision.csv").write_text("t\n", encoding="utf-8")
    assert modrob(*command, "-j", "1", "--resume", "-o", fleet / "two").exit_code == 3
    assert files_of(fleet / "one") == files_of(fleet / "two")
    (fleet / "logs" / "junk.mcap").rename(fleet / "junk.mcap")
    (fleet / "logs" / "cut.mcap").rename(fleet / "cut.mcap")
    kept = modrob(*command, "-j", "1", "--resume", "-o", fleet / "two")
    assert kept.exit_code == 4, kept.output
    assert "4 kept from the run before" in kept.stderr


def test_the_results_about_all_logs_agree(modrob: Modrob, fleet: Path) -> None:
    """Summary, tables, events and thresholds against the records of the logs."""
    logs = (fleet / "logs" / "a.mcap", fleet / "logs" / "b.mcap", fleet / "motion.yaml")
    result = modrob("collision", ARM, *logs, *QUICK[:-1], "1", "--json", "-o", fleet / "all")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    out = fleet / "all"
    records = [
        json.loads((out / f"{name}.collision.json").read_text(encoding="utf-8")) for name in ("a", "b", "motion")
    ]
    summary = json.loads((out / f"{NAME}.summary.json").read_text(encoding="utf-8"))
    assert summary == {key: value for key, value in data.items() if key != "files"}
    assert [record["logs"][0] for record in records] == data["logs"]
    table = pyarrow.parquet.read_table(out / f"{NAME}.logs.parquet").to_pylist()
    assert len(table) == 3 * 6
    for row in table:
        log = next(log for log in data["logs"] if log["log"] == row["log"])
        assert row["events"] == (None if log["planned"] else sum(e["joint"] == row["joint"] for e in log["events"]))
        near = {joint["joint"]: joint["share"] for joint in log["closest"] or []}
        assert row["share"] == near.get(row["joint"])
    assert (out / f"{NAME}.logs.csv").read_text(encoding="utf-8").count("\n") == 3 * 6 + 1
    document = yaml.safe_load((out / f"{NAME}.thresholds.yaml").read_text(encoding="utf-8"))
    for phase in ("acceleration", "nominal"):
        most = np.max([log["thresholds"][phase]["torque"] for log in data["logs"]], axis=0)
        lower = np.array(document["request"][f"lower_torque_thresholds_{phase}"])
        assert (lower >= most).all()
        assert np.allclose(lower, most, rtol=1e-3)  # four digits
    # Only the worst log has a picture and a page; the page about all leads to it.
    assert [(log["page"], log["picture"]) for log in data["logs"]] == [
        (None, None),
        ("b.collision.html", "b.collision.png"),
        (None, None),
    ]
    page = (out / f"{NAME}.html").read_text(encoding="utf-8")
    assert 'href="b.collision.html"' in page
    assert 'href="a.collision.json"' in page
    assert "1 event in 2 logs" in page or "events in 2 logs" in page
    assert {path.name for path in out.iterdir() if not path.name.startswith(".")} == {
        Path(path).name for path in data["files"].values()
    }


def test_how_near_the_torque_came(modrob: Modrob, hit_logs: Path, tmp_path: Path) -> None:
    """From the columns of the CSV file, which has all samples of a short log."""
    result = modrob("collision", ARM, hit_logs / "clean.mcap", *QUICK, "--json", "-o", tmp_path)
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    lines = (tmp_path / "clean.collision.csv").read_text(encoding="utf-8").splitlines()
    header = lines[0].split(",")
    columns = dict(zip(header, np.array([line.split(",") for line in lines[1:]], dtype=float).T, strict=True))
    for joint in data["logs"][0]["closest"]:
        measured, lower, upper = (columns[f"{joint['joint']}.{kind}"] for kind in ("measured", "lower", "upper"))
        share = np.abs(2.0 * measured - lower - upper) / (upper - lower)
        assert joint["share"] == pytest.approx(share.max(), rel=1e-9)
        assert joint["time"] == pytest.approx(columns["t"][share.argmax()])
        assert 0.0 < joint["share"] < 1.0
    assert "report" not in data["files"]  # --details 0


def test_long_logs_are_judged_stretch_by_stretch(
    modrob: Modrob, hit_logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same files but for rounding, and the page; training runs go the same way."""
    more = ("--filter", "butterworth2:20", "--train", hit_logs / "clean.mcap", "--json")
    command = ("collision", ARM, hit_logs / "pushed.mcap", *STATED, "--skip", "0.2", "--no-compare", *more)
    whole = modrob(*command, "--details", "0", "-o", tmp_path / "whole")
    assert whole.exit_code == 0, whole.output
    through_files = partial(open_run, stretch=100, long=True, window=64)
    for module in ("collision", "collision_task"):
        monkeypatch.setattr(f"modrob_cli.workflows.{module}.open_run", through_files)
    monkeypatch.setattr("modrob_cli.workflows.collision_drawing.MOST_BLOCKS", 300)
    parts = modrob(*command, "-o", tmp_path / "parts")
    assert parts.exit_code == 0, parts.output
    one, other = (json.loads(result.stdout)["logs"][0] for result in (whole, parts))
    assert len(one["events"]) == len(other["events"]) > 0
    for ours, theirs in zip(one["events"], other["events"], strict=True):
        numbers = {key: value for key, value in theirs.items() if isinstance(value, float)}
        assert {key: ours[key] for key in numbers} == pytest.approx(numbers, rel=1e-9)
        assert (ours["joint"], ours["side"]) == (theirs["joint"], theirs["side"])
    assert one["methods"] == other["methods"]
    left, right = (
        np.genfromtxt(tmp_path / name / "pushed.collision.csv", delimiter=",")[1:] for name in ("whole", "parts")
    )
    assert np.allclose(left, right, rtol=1e-9, atol=1e-9)
    assert (tmp_path / "parts" / "pushed.collision.png").stat().st_size > 10_000
    assert "Collision found" in (tmp_path / "parts" / f"{NAME}.html").read_text(encoding="utf-8")


def test_a_log_that_does_not_fit_the_options_fails_alone(modrob: Modrob, fleet: Path, tmp_path: Path) -> None:
    """A log that is shorter than what is skipped, beside a planned motion, which has nothing to skip."""
    logs = (fleet / "logs" / "a.mcap", fleet / "motion.yaml")
    result = modrob("collision", ARM, *logs, *STATED, "--skip", "9", "--details", "0", "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert "--skip 9 leaves nothing of the log" in result.stderr
    assert (tmp_path / "out" / "motion.collision.json").is_file()
    fast = modrob("collision", ARM, *logs, *STATED, "--skip", "9", "--fail-fast", "-j", "1", "-o", tmp_path / "fast")
    assert fast.exit_code == 3
    assert not (tmp_path / "fast").exists()


def test_recordings_that_are_written_can_be_read(modrob: Modrob, hit_logs: Path, tmp_path: Path) -> None:
    """Joint states at the times of the log, read by our own reader as any other log."""
    result = modrob("collision", ARM, hit_logs / "clean.mcap", *QUICK, "-o", tmp_path)
    assert result.exit_code == 0, result.output
    source = read_recording(hit_logs / "clean.mcap")
    kept = source.stamps[source.stamps - source.stamps[0] >= 200_000_000]
    with (tmp_path / "clean.collision.mcap").open("rb") as stream:
        times = [message.log_time for *_, message in make_reader(stream).iter_messages(topics=["/collision/lower"])]
    assert times == kept.tolist()
