"""``modrob identify`` over many logs: bad ones among them, interrupted runs, several processes."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from modrob_cli.batch.jobs import LogJob
from modrob_cli.cli.app import app
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.workflows import identify_write
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_pooled import look_at_all, make_ready
from modrob_cli.workflows.identify_report_logs import FEW, log_sections, skipped_section
from modrob_cli.workflows.identify_result import worst_first
from modrob_cli.workflows.robots import load_robot
from tests.identify_samples import URDF, record

NAMES = ("waist", "shoulder", "elbow")
START = 1_770_000_000
"""2026-02-02T02:40:00Z"""


def modrob(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["identify", *(str(argument) for argument in arguments)])


def save(path: Path, seed: int, duration: float = 10.0) -> Path:
    """A log of a day, as many days after the first as the seed says."""
    log = record(seed, duration=duration, rate=100.0).log
    stamps = (START + 86_400 * seed) * 10**9 + np.round(log.t * 1e9).astype(np.int64)
    velocity = np.full_like(log.q, np.nan)
    write_mcap(path, [Series("/joint_states", joint_state(NAMES), stamps, np.hstack([log.q, velocity, log.effort]))])
    return path


@pytest.fixture(scope="module", autouse=True)
def no_pictures() -> Iterator[None]:
    """Pictures as PNG are slow, and drawn in this process from what is compared here anyway."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("draw_friction_of", "draw_torques_of", "draw_filter_of"):
            patch.setattr(identify_write, name, lambda *arguments: None)
        yield


@pytest.fixture
def no_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor a page, where it does not matter."""
    monkeypatch.setattr(identify_write, "identification_report", lambda *arguments: None)
    monkeypatch.setattr(identify_write, "render", lambda report: "")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot and five logs, two of which cannot be used and one of which is too short."""
    folder = tmp_path_factory.mktemp("identify-batch")
    (folder / "three.urdf").write_text(URDF)
    (folder / "runs").mkdir()
    for seed in range(3):
        save(folder / "runs" / f"run_{seed}.mcap", seed)
    (folder / "runs" / "broken.mcap").write_bytes(b"no log at all")
    save(folder / "runs" / "short.mcap", 9, duration=0.3)
    return folder


@pytest.fixture(scope="module")
def done(place: Path) -> dict[str, Any]:
    """All of them in one call, by one process."""
    logs = (place / "runs", place / "runs" / "missing.mcap")
    result = modrob(place / "three.urdf", *logs, "--effort", "torque", "-o", place / "all", "--json", "-j", 1)
    # 3: the file that is no log; it counts more than 5, the one that is too short.
    assert result.exit_code == 3, result.output
    assert "broken.mcap" in result.stderr
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def good(place: Path) -> list[Path]:
    return [place / "runs" / f"run_{seed}.mcap" for seed in range(3)]


def contents(folder: Path) -> dict[str, bytes]:
    """Files that are left, without the lock."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if not path.name.endswith(".lock")}


def test_bad_logs_are_named_and_the_others_count(place: Path, done: dict[str, Any]) -> None:
    codes = {Path(entry["log"]).name: entry["code"] for entry in done["skipped"]}
    assert codes == {"broken.mcap": 3, "short.mcap": 5, "missing.mcap": 3}
    assert all(entry["reason"] for entry in done["skipped"])
    assert [log["name"] for log in done["logs"]] == ["run_0", "run_1", "run_2"]
    assert [log["date"] for log in done["logs"]] == [f"2026-02-0{2 + seed}T02:40:00Z" for seed in range(3)]
    records = {f"{log['name']}.identify.json" for log in done["logs"]}
    # The short one is read and says why it has no fit.
    assert records | {"short.identify.json"} == {name for name in done["files"] if name.endswith(".identify.json")}
    assert all(Path(path).exists() for path in done["files"].values())


@pytest.mark.usefixtures("no_report")
def test_the_pooled_fit_is_that_of_the_good_logs(place: Path, done: dict[str, Any], tmp_path: Path) -> None:
    arguments = ("--effort", "torque", "--cutoff", done["signals"]["cutoff"], "-o", tmp_path, "--json")
    result = modrob(place / "three.urdf", *good(place), *arguments, "--pooled-only")
    assert result.exit_code == 0, result.output
    alone = json.loads(result.stdout)
    for joint, other in zip(done["joints"], alone["joints"], strict=True):
        for key in ("viscous", "coulomb", "reflected_inertia", "offset"):
            assert joint[key] == other[key]
    assert not any(path.name.startswith("run_") for path in tmp_path.iterdir())


@pytest.mark.usefixtures("no_report")
def test_a_log_of_its_own_and_among_others(place: Path, done: dict[str, Any], tmp_path: Path) -> None:
    result = modrob(place / "three.urdf", good(place)[1], "--effort", "torque", "-o", tmp_path, "--json")
    single = json.loads(result.stdout)
    kept = json.loads((place / "all" / "run_1.identify.json").read_text())
    assert kept["signals"]["cutoff"] == single["signals"]["cutoff"]
    for joint, other, again in zip(single["joints"], kept["fit"], done["logs"][1]["fit"], strict=True):
        assert other == again
        for key in ("viscous", "coulomb", "stderr", "interval", "holdout"):
            assert joint[key] == other[key]


def test_same_bytes_with_several_processes(place: Path, done: dict[str, Any], tmp_path: Path) -> None:
    logs = (place / "runs", place / "runs" / "missing.mcap")
    modrob(place / "three.urdf", *logs, "--effort", "torque", "-o", tmp_path, "-j", 2)
    assert contents(tmp_path) == contents(place / "all")


@pytest.mark.usefixtures("no_report")
def test_resume_keeps_what_is_done(place: Path, tmp_path: Path) -> None:
    arguments = (place / "three.urdf", *good(place), "--effort", "torque", "-o", tmp_path, "-j", 1)
    assert modrob(*arguments).exit_code == 0
    whole = contents(tmp_path)
    assert modrob(*arguments).exit_code == 6
    for name in ("three.identify.json", "three.identified.robot.yaml", "run_1.identify.json"):
        (tmp_path / name).unlink()
    times = {name: (tmp_path / name).stat().st_mtime_ns for name in ("run_0.identify.json", "run_2.identify.json")}
    again = modrob(*arguments, "--resume")
    assert again.exit_code == 0, again.output
    assert "2 kept from the run before" in again.stderr
    assert contents(tmp_path) == whole
    assert {name: (tmp_path / name).stat().st_mtime_ns for name in times} == times
    # Another friction model makes all of them stale; another limit of the verdict none.
    assert "kept" not in modrob(*arguments, "--resume", "--friction", "viscous").stderr
    limited = modrob(*arguments, "--resume", "--friction", "viscous", "--max-nrmse", 1e-6)
    assert "3 kept from the run before" in limited.stderr
    assert limited.exit_code == 4


def test_fail_fast_stops_at_the_first(place: Path, tmp_path: Path) -> None:
    logs = (place / "runs" / "broken.mcap", *good(place))
    result = modrob(place / "three.urdf", *logs, "--effort", "torque", "-o", tmp_path, "--fail-fast", "-j", 1)
    assert result.exit_code == 3
    assert not (tmp_path / "three.identify.json").exists()
    assert not (tmp_path / "run_2.identify.json").exists()


def test_all_logs_bad(place: Path, tmp_path: Path) -> None:
    logs = (place / "runs" / "broken.mcap", place / "runs" / "missing.mcap")
    result = modrob(place / "three.urdf", *logs, "--effort", "torque", "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert "broken.mcap" in result.stderr
    assert "missing.mcap: file not found" in result.stderr
    assert not (tmp_path / "out" / "three.identify.json").exists()


def test_a_log_that_goes_or_changes_meanwhile_is_left_out(place: Path, tmp_path: Path) -> None:
    robot = load_robot(place / "three.urdf").robot
    paths = [save(tmp_path / f"run_{seed}.mcap", seed) for seed in range(3)]
    jobs = [LogJob(path.stem, str(path)) for path in paths]
    options = IdentifyOptions("torque")
    outcomes, _ = look_at_all(robot, jobs, options, False, None)
    paths[0].unlink()
    save(paths[1], 7)
    told: list[float] = []
    pooled = make_ready(robot, outcomes, {}, options, False, lambda what, fraction: told.append(fraction))
    assert [item.found.job.name for item in pooled.runs] == ["run_2"]
    reasons = [outcome.failure.reason for outcome in pooled.failed if outcome.failure is not None]
    assert "file not found" in reasons[0]
    assert "has changed" in reasons[1]
    assert told == sorted(told)


def test_logs_do_not_stay_in_memory_as_read(place: Path) -> None:
    robot = load_robot(place / "three.urdf").robot
    jobs = [LogJob(path.stem, str(path)) for path in good(place)]
    options = IdentifyOptions("torque")
    outcomes, read = look_at_all(robot, jobs, options, False, None)
    assert len(read) == 3
    pooled = make_ready(robot, outcomes, read, options, False, lambda what, fraction: None)
    assert read == {}
    # Torque is recorded as such, so that there is one array of it and not two.
    assert all(item.whole.tau is item.whole.signals.effort for item in pooled.runs)


def entries(count: int) -> list[dict[str, Any]]:
    """Logs that are predicted better and better."""
    facts: dict[str, Any] = {
        "date": None,
        "duration": 3.0,
        "samples": 300,
        "samples_fitted": 180,
        "samples_held_out": 110,
    }
    facts |= {"rate": 100.0, "velocity": "recorded", "notes": ["a clock that jumps"], "fit": None}
    ratios: Sequence[float] = np.linspace(2.0, 0.1, count).tolist()
    return [
        {"log": f"logs/run_{k}.mcap", "name": f"run_{k}", "prediction": [{"name": "a", "nrmse": x}], **facts}
        for k, x in enumerate(ratios)
    ]


def test_a_thousand_logs_stay_readable() -> None:
    logs = entries(1000)
    shuffled = [logs[k] for k in np.random.default_rng(3).permutation(1000)]
    assert worst_first(shuffled) == logs
    signals = {"cutoff": 10.0, "rule": "given"}
    worst, everything = log_sections({"logs": shuffled, "signals": signals})
    assert not worst.folded
    table = worst.blocks[0]
    assert len(table.rows) == FEW  # type: ignore[union-attr]
    assert everything.folded
    assert len(everything.blocks[0].rows) == 1000  # type: ignore[union-attr]
    notes = worst.blocks[-1].items  # type: ignore[union-attr]
    assert len(notes) == 2
    assert notes[1].startswith("1000 logs (")
    bad = [{"log": f"{k}.mcap", "reason": "no log", "code": 3} for k in range(200)]
    (section,) = skipped_section(bad)
    assert "150 more" in section.blocks[0].caption  # type: ignore[union-attr]
    assert skipped_section([]) == []
