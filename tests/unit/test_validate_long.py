"""Logs judged stretch by stretch against the same logs judged as a whole."""

import csv
import json
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from modrob_cli.cli.app import app
from modrob_cli.errors import InputFileError, NumericalError
from modrob_cli.identify.long_signals import Sizes
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.outputs import OutputFolder, sha256
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.model.log import JointLog, UsedLog
from modrob_cli.workflows.robots import LoadedRobot, load_robot
from modrob_cli.workflows.validate_files import write_series
from modrob_cli.workflows.validate_judge import judge_log
from modrob_cli.workflows.validate_long import LongSizes, judge_long
from modrob_cli.workflows.validate_long_files import LongPage
from modrob_cli.workflows.validate_options import FrictionFrom, ValidateOptions
from modrob_cli.workflows.validate_result import log_result
from tests.identify_samples import TRUTH, URDF, record
from tests.shared_data import shared

ALL = 10**9
SIZES = LongSizes(Sizes(stretch=900, segment=ALL, sample=ALL), fit=ALL, rows=ALL)
"""Small stretches; whatever is otherwise defined for long logs as for short ones, so that all numbers have to agree."""

ORIGIN = 1_700_000_000 * 10**9
NAMES = ("waist", "shoulder", "elbow")


@pytest.fixture
def arm(tmp_path: Path) -> LoadedRobot:
    """Three joints without friction."""
    path = tmp_path / "three.urdf"
    path.write_text(URDF)
    return load_robot(path)


def write_log(path: Path, log: JointLog) -> Path:
    """Write an MCAP file."""
    layout = joint_state(log.joint_names, velocity=log.dq is not None)
    parts = [log.q, log.effort] if log.dq is None else [log.q, log.dq, log.effort]
    stamps = ORIGIN + np.rint(log.t * 1e9).astype(np.int64)
    write_mcap(path, [Series("/joint_states", layout, stamps, np.hstack(parts))])
    return path


def as_whole(loaded: LoadedRobot, path: Path, options: ValidateOptions, out: Path) -> dict[str, Any]:
    """The result of a log that fits into memory."""
    log = judge_log(loaded, path, options)
    write_series(loaded.robot, log, out)
    return log_result(loaded.robot, str(path), log, options)


def in_stretches(
    loaded: LoadedRobot, path: Path, options: ValidateOptions, out: Path, sizes: LongSizes = SIZES, page: bool = False
) -> dict[str, Any]:
    """The result of the same log, judged as a long one."""
    with OutputFolder(out, overwrite=True) as folder:
        about = LongPage("page.html", {}) if page else None
        return judge_long(loaded, "log", str(path), path, options, folder, about, sizes)


def assert_same(found: Any, expected: Any, where: str = "") -> None:
    """Plain data, numbers to 1e-9: what is left are rounding errors of sums of thousands of samples."""
    if isinstance(expected, dict):
        assert list(found) == list(expected), where
        for key, value in expected.items():
            assert_same(found[key], value, f"{where}.{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for k, value in enumerate(expected):
            assert_same(found[k], value, f"{where}[{k}]")
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-12), where
    else:
        assert found == expected, where


def read_table(path: Path) -> tuple[list[str], np.ndarray[Any, Any]]:
    """Header and numbers of a CSV file."""
    with path.open() as stream:
        header, *rows = csv.reader(stream)
    return header, np.array(rows, dtype=float)


def compare(loaded: LoadedRobot, path: Path, options: ValidateOptions, tmp_path: Path) -> dict[str, Any]:
    """Judge both ways; the result of the long one."""
    expected = as_whole(loaded, path, options, tmp_path / "whole.csv")
    found = in_stretches(loaded, path, options, tmp_path / "out")
    stretches = found.pop("stretches")
    assert_same(found, expected)
    assert len(stretches) >= 2
    assert sum(stretch["samples"] for stretch in stretches) == expected["samples_used"]
    for j, joint in enumerate(expected["joints"]):
        parts = [(stretch["samples"], stretch["joints"][j]) for stretch in stretches]
        total = expected["samples_used"]
        square = sum(samples * part["rmse"] ** 2 for samples, part in parts) / total
        assert np.sqrt(square) == pytest.approx(joint["rmse"], rel=1e-9)
        inside = sum(samples * part["inside"] for samples, part in parts) / total
        assert inside == pytest.approx(joint["inside"], rel=1e-9)
    header, rows = read_table(tmp_path / "out" / "log.validate.csv")
    whole_header, whole_rows = read_table(tmp_path / "whole.csv")
    assert header == whole_header
    if len(rows) == len(whole_rows):  # else parts of a gap are left out
        scale = np.abs(whole_rows).max(axis=0)
        np.testing.assert_allclose(rows, whole_rows, rtol=1e-9, atol=1e-9 * scale.max())
    return {**found, "stretches": stretches}


def uneven(log: JointLog) -> JointLog:
    """Jitter, a short and a long gap."""
    rng = np.random.default_rng(0)
    kept = np.ones(len(log.t), dtype=bool)
    kept[700:720] = kept[2000:3700] = False
    t = log.t + np.round(rng.uniform(0.0, 0.001, len(log.t)), 9)
    dq = None if log.dq is None else log.dq[kept]
    return replace(log, t=t[kept] - t[0], q=log.q[kept], dq=dq, effort=log.effort[kept])


def glitched(log: JointLog) -> JointLog:
    """Single wild positions."""
    q = log.q.copy()
    q[[500, 899, 900, 3333], [0, 1, 2, 1]] += 1.5
    return replace(log, q=q)


def still(log: JointLog) -> JointLog:
    """The first joint stands still, and no torque of the last one is recorded."""
    q, effort = log.q.copy(), log.effort.copy()
    q[:, 0], effort[:, 2] = 0.3, 0.0
    return replace(log, q=q, dq=None, effort=effort)


CHANGES: dict[str, Callable[[JointLog], JointLog]] = {
    "even": lambda log: log,
    "uneven": uneven,
    "glitched": glitched,
    "still": still,
}


@pytest.mark.parametrize("change", list(CHANGES))
@pytest.mark.parametrize("friction", ["file", "held-out", "in-sample"])
@pytest.mark.parametrize("velocity", [True, False])
def test_stretches_are_the_whole(
    arm: LoadedRobot, tmp_path: Path, friction: FrictionFrom, change: str, velocity: bool
) -> None:
    log = CHANGES[change](record(3, duration=25.0, recorded_velocity=velocity).log)
    path = write_log(tmp_path / "log.mcap", log)
    options = ValidateOptions("torque", friction=friction, max_nrmse=0.5, accept_fitted=True)
    found = compare(arm, path, options, tmp_path)
    assert found["joints"][1]["passed"] is (friction != "file")  # the file knows no friction


@pytest.mark.parametrize(
    ("model", "recording", "effort"),
    [
        ("ur10/model.urdf", "ur10/ur10_exciting_trajectory.mcap", "torque"),
        ("staubli_tx40/model.urdf", "staubli_tx40/ident.mcap", "torque"),
        ("", "schunk_lwa4p/runs/run_001.mcap", "net-torque"),
    ],
)
@pytest.mark.parametrize("friction", ["file", "held-out"])
def test_recordings(tmp_path: Path, model: str, recording: str, effort: Any, friction: FrictionFrom) -> None:
    path = shared(recording)
    robot = shared(model) if model else Path(__file__).parents[2] / "assemblies" / "lwa4p-6.yaml"
    renamed = (
        {f"joint_{k + 1}": name for k, name in enumerate(load_robot(robot).robot.joint_names)} if not model else {}
    )
    options = ValidateOptions(effort, reading=LogOptions(joint_map=renamed), friction=friction)
    sizes = replace(SIZES, motion=replace(SIZES.motion, stretch=300))
    expected = as_whole(load_robot(robot), path, options, tmp_path / "whole.csv")
    found = in_stretches(load_robot(robot), path, options, tmp_path / "out", sizes)
    del found["stretches"]
    assert_same(found, expected)


@pytest.mark.parametrize("end", [9.0, None])
def test_what_the_file_was_fitted_to_does_not_count(arm: LoadedRobot, tmp_path: Path, end: float | None) -> None:
    """The first 9 s, or the whole log, which is then judged without a verdict."""
    path = write_log(tmp_path / "log.mcap", uneven(record(3, duration=25.0).log))
    fitted = replace(arm, identified_from=(UsedLog("log.mcap", sha256(path), 0.0, end), UsedLog("other", "00")))
    options = ValidateOptions("torque", friction="file", max_nrmse=10.0)
    found = compare(fitted, path, options, tmp_path)
    assert found["fitted_to_these_samples"] is (end is None)
    assert found["joints"][0]["passed"] is (None if end is None else True)
    assert (found["seconds_left_out"] > 9.0) is (end is not None)


def test_friction_is_fitted_to_the_beginning(arm: LoadedRobot, tmp_path: Path) -> None:
    """Of a long log the first part tells the friction; it is that of the arm, and a note says how much was used."""
    path = write_log(tmp_path / "log.mcap", record(5, duration=60.0, recorded_velocity=True).log)
    sizes = replace(SIZES, fit=4000, rows=500)
    found = in_stretches(arm, path, ValidateOptions("torque", friction="held-out"), tmp_path / "out", sizes)
    assert "friction was fitted to the first 4000 of" in found["notes"][0]
    assert "one sample of 24" in found["notes"][1]
    for joint, truth in zip(found["joints"], TRUTH, strict=True):
        values = [joint["fit"][key] for key in ("offset", "coulomb", "viscous", "reflected_inertia")]
        # 20 s of noise of 0.5 to 1.5 N m with a correlation time of 0.1 s: about 200 independent samples.
        np.testing.assert_allclose(values, truth, atol=0.6)
    header, rows = read_table(tmp_path / "out" / "log.validate.csv")
    assert 500 <= len(rows) < 650
    assert np.all(np.diff(rows[:, 0]) > 0.0)
    for j, name in enumerate(NAMES):
        error = rows[:, header.index(f"{name}.recorded")] - rows[:, header.index(f"{name}.predicted")]
        counted = np.where(rows[:, 1] > 0.0, np.abs(error), 0.0)
        assert counted.max() == pytest.approx(found["joints"][j]["max_error"], rel=1e-9)
        assert rows[np.argmax(counted), 0] == pytest.approx(found["joints"][j]["worst_time"], abs=1e-9)


def test_drift_shows_in_the_stretches_and_on_the_page(arm: LoadedRobot, tmp_path: Path) -> None:
    """Friction of one joint grows from second 40 on; fitted before, it is judged worse from there."""
    log = record(5, duration=60.0, recorded_velocity=True).log
    effort = log.effort.copy()
    effort[:, 1] += np.where(log.t > 40.0, 8.0, 0.0) * np.sign(np.asarray(log.dq)[:, 1])
    path = write_log(tmp_path / "log.mcap", replace(log, effort=effort))
    options = ValidateOptions("torque", holdout=0.6, max_nrmse=0.3)
    found = in_stretches(arm, path, options, tmp_path / "out", page=True)
    assert found["stretches"][0]["start"] >= 24.0
    before = [one for one in found["stretches"] if one["end"] < 40.0]
    after = [one for one in found["stretches"] if one["start"] > 40.0]
    least = min(one["joints"][1]["nrmse"] for one in after)
    assert least > 2.0 * max(one["joints"][1]["nrmse"] for one in before)
    page = (tmp_path / "out" / "page.html").read_text()
    assert "Over the time of the log" in page
    assert "the stretch with the largest NRMSE" in page
    assert (tmp_path / "out" / "log.validate.png").read_bytes().startswith(b"\x89PNG")


def test_a_cut_log_is_judged_as_far_as_it_goes(arm: LoadedRobot, tmp_path: Path) -> None:
    path = write_log(tmp_path / "log.mcap", record(3, duration=25.0).log)
    raw = path.read_bytes()
    path.write_bytes(raw[: len(raw) * 2 // 3])
    options = ValidateOptions("torque", friction="file")
    found = compare(arm, path, options, tmp_path)
    assert found["samples"] < 4000
    assert "the file ends in the middle" in found["notes"][0]
    with pytest.raises(InputFileError, match="--strict refuses"):
        in_stretches(arm, path, replace(options, reading=LogOptions(strict=True)), tmp_path / "out")


def test_logs_that_cannot_be_judged(arm: LoadedRobot, tmp_path: Path) -> None:
    log = record(3, duration=25.0).log
    short = replace(log, t=log.t[:40], q=log.q[:40], effort=log.effort[:40])
    for bad in (short, replace(log, t=log.t / 1000.0)):
        path = write_log(tmp_path / "log.mcap", bad)
        with pytest.raises(NumericalError, match="use a longer log"):
            in_stretches(arm, path, ValidateOptions("torque"), tmp_path / "out")
    q = log.q.copy()
    q[4000, 1] = 1e13
    path = write_log(tmp_path / "log.mcap", replace(log, q=q))
    with pytest.raises(InputFileError, match="found positions up to 1e\\+13"):
        in_stretches(arm, path, ValidateOptions("torque"), tmp_path / "out")
    path = write_log(tmp_path / "log.mcap", log)
    with pytest.raises(NumericalError, match="no samples are left"):
        in_stretches(arm, path, ValidateOptions("torque", holdout=0.001), tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == [] if (tmp_path / "out").exists() else True


def test_memory_does_not_grow_with_the_log(arm: LoadedRobot, tmp_path: Path) -> None:
    """Four times the samples take a fifth more memory at most; jitter and a glitch, so that all passes are made.

    A chunk of the file, 7000 messages, takes most of it.
    """
    sizes = LongSizes(Sizes(stretch=1024, segment=1024, sample=1024), fit=3000, rows=1000, window=1024)
    options = ValidateOptions("torque", friction="held-out")
    one = glitched(uneven(record(3, duration=40.0).log))
    peaks = []
    for times in (3, 12):
        t = np.concatenate([one.t + 40.0 * k for k in range(times)])
        q, effort = np.tile(one.q, (times, 1)), np.tile(one.effort, (times, 1))
        path = write_log(tmp_path / "log.mcap", replace(one, t=t, q=q, effort=effort))
        in_stretches(arm, path, options, tmp_path / "out", sizes)  # imports and caches
        tracemalloc.start()
        try:
            in_stretches(arm, path, options, tmp_path / "out", sizes)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0], peaks


def test_the_command_takes_long_logs(arm: LoadedRobot, tmp_path: Path) -> None:
    """150,000 samples: as many as make a log long."""
    count = 150_000
    one = record(3, duration=20.0, recorded_velocity=True).log
    assert one.dq is not None
    q, dq, effort = (np.tile(x, (38, 1))[:count] for x in (one.q, one.dq, one.effort))
    path = write_log(tmp_path / "run.mcap", replace(one, t=np.arange(count) / 200.0, q=q, dq=dq, effort=effort))
    arguments = ["validate", arm.files[0], path, "--effort", "torque", "-o", tmp_path / "out", "--json"]
    done = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert done.exit_code == 0, done.output
    (log,) = json.loads(done.stdout)["logs"]
    assert (log["samples"], len(log["stretches"])) == (count, 2)  # the third stretch was fitted to
    assert log["notes"] == []
    assert (tmp_path / "out" / log["picture"]).is_file()
    with (tmp_path / "out" / "run.validate.csv").open() as stream:
        assert sum(1 for _ in stream) == count + 1
