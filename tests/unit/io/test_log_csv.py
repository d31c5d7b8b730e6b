"""Logs as CSV: columns, times in whole nanoseconds, missing values, what is refused."""

from pathlib import Path

import numpy as np
import pytest

from modrob_cli.errors import InputFileError
from modrob_cli.io.log_csv import read_log_csv, write_log_csv
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.model.log import Recording


def csv(folder: Path, text: str) -> Path:
    path = folder / "run.csv"
    path.write_text(text)
    return path


def refusal(path: Path, *arguments: object) -> str:
    with pytest.raises(InputFileError) as caught:
        read_log_csv(path, *arguments)  # type: ignore[arg-type]
    return str(caught.value)


def test_columns_by_name_and_by_number(tmp_path: Path) -> None:
    named = csv(tmp_path, "t,effort.b,q.a,q.b,effort.a,ddq.a\n0.5,1,2,3,4,9\n0.6,5,6,7,8,9\n")
    log = read_joint_log(named, ("a", "b"))
    np.testing.assert_array_equal(log.q, [[2, 3], [6, 7]])
    np.testing.assert_array_equal(log.effort, [[4, 1], [8, 5]])
    assert log.dq is None
    numbered = csv(tmp_path, "t, q1, q2, dq1, dq2, effort1, effort2\r\n0,1,2,3,4,5,6\r\n\r\n1e-3,1,2,3,4,5,6\r\n")
    log = read_joint_log(numbered, ("x", "y"))
    assert log.joint_names == ("x", "y")
    np.testing.assert_array_equal(log.dq, [[3, 4], [3, 4]])
    assert read_joint_log(numbered).joint_names == ("joint1", "joint2")
    mapped = read_joint_log(numbered, ("y",), options=LogOptions(joint_map={"joint2": "y"}))
    np.testing.assert_array_equal(mapped.q, [[2], [2]])
    assert mapped.notes == ("ignored joints of the log: 1",)


def test_times_are_whole_nanoseconds(tmp_path: Path) -> None:
    times = ["1700000000.000000001", "1700000000.1", "1700000000.2000000004", "17.000000003e8", "1700000001"]
    path = csv(tmp_path, "t,q1\n" + "".join(f"{time},0\n" for time in times))
    stamps = read_log_csv(path).stamps
    assert stamps.tolist() == [
        1_700_000_000_000_000_001, 1_700_000_000_100_000_000, 1_700_000_000_200_000_000, 1_700_000_000_300_000_000,
        1_700_000_001_000_000_000,
    ]  # fmt: skip


def test_what_is_written_reads_back_equal(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    stamps = np.cumsum(rng.integers(1, 10**10, size=500)) + 1_600_000_000_000_000_000
    q, dq = rng.normal(size=(2, 500, 3)) * 10.0 ** rng.integers(-300, 300, size=(2, 500, 3))
    dq[rng.random((500, 3)) < 0.2] = np.nan
    original = Recording("run", "", "header", ("a", 'quote "x", comma', "é"), stamps, q, dq, None)
    path = tmp_path / "run.csv"
    write_log_csv(path, original)
    again = read_log_csv(path)
    assert again.joint_names == original.joint_names
    for key in ("stamps", "q", "dq"):
        np.testing.assert_array_equal(getattr(again, key), getattr(original, key))
    assert again.effort is None


def test_missing_and_repeated(tmp_path: Path) -> None:
    path = csv(tmp_path, "t,q.a,effort.a\n0,1,2\n1,,3\n2,4,nan\n2,5,6\n3,7,8\n")
    log = read_joint_log(path)
    np.testing.assert_array_equal(log.t, [0, 3])
    assert log.notes == (
        "1 lines repeated the time before and were left out",
        "2 of 4 samples lack a position or an effort and were left out",
    )


def test_a_last_line_that_is_cut_is_left_out(tmp_path: Path) -> None:
    path = csv(tmp_path, "t,q.a,effort.a\n0,1,2\n1,2,3\n2,4")
    log = read_joint_log(path)
    assert len(log.t) == 2
    assert log.notes == ("damaged: the last line is cut and was left out",)
    with pytest.raises(InputFileError, match="--strict refuses"):
        read_joint_log(path, options=LogOptions(strict=True))
    # A last line without a line end is whole if nothing is missing.
    assert len(read_joint_log(csv(tmp_path, "t,q.a,effort.a\n0,1,2\n1,2,3")).t) == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "found an empty file"),
        ("\n0,1\n", "found an empty first line"),
        ("time,q1\n0,1\n", "found no t as the first column"),
        ("t,q1,tau1\n0,1,2\n", "the columns tau1"),
        ("t,q1,q1\n0,1,2\n", "the columns q1"),
        ("t\n0\n", "no columns but t"),
        ("t,dq1\n0,1\n", "found no positions"),
        ("t,q1\n", "found no samples"),
        ("t,q1\n0,1\n", "found 1 time, expected 2 or more"),
        ("t,q1\n0,1\nx,2\n0,3,4\n1,y\n", "run.csv:3: found a cell that is no number"),
        ("t,q1\n0,1\n0.1,2,3\n", "run.csv:3: found 3 columns, expected 2"),
        ("t,q1\n1,1\n0.25,2\n3,2\n", "run.csv:3: column t: found a time 0.75 s before"),
        ("t,q1\n0,1\n1e999999999,2\n", "run.csv:3: found a cell that is no number (or a time out of range)"),
        ("t,q1\n0,1\nnan,2\n", "run.csv:3"),
        ("t,q1\n0,1\n,2\n", "run.csv:3"),
        ("t,q1\n0,1\n" + "1" * 2**20 + "\n", "in one line"),
        ("t,q\x00.a\n0,1\n", "q\\x00.a"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, words: str) -> None:
    assert words in refusal(csv(tmp_path, text))


def test_joints_that_do_not_match(tmp_path: Path) -> None:
    numbered, named = "t,q1,q2\n0,1,2\n1,2,3\n", "t,q.a,q.b\n0,1,2\n1,2,3\n"
    assert "found columns for 2 joints, expected 1: x" in refusal(csv(tmp_path, numbered), ("x",))
    assert "not in the log: x; the log has a, b" in refusal(csv(tmp_path, named), ("a", "x"))
    assert "--map renames c; the log has a, b" in refusal(csv(tmp_path, named), None, {"c": "x"})
    assert "--map gives two joints one name" in refusal(csv(tmp_path, named), None, {"a": "b"})
    assert "file not found" in refusal(tmp_path / "none.csv")
    (tmp_path / "folder.csv").mkdir()
    assert "found a folder" in refusal(tmp_path / "folder.csv")


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rng = np.random.default_rng(2)
    for _ in range(200):
        path.write_bytes(b"t,q1\n0,1\n" + rng.bytes(60))
        with pytest.raises(InputFileError):
            read_log_csv(path)
    path.write_bytes(b"\xff\xfet,q1\n0,1\n")
    assert "not a line of CSV" in refusal(path)
