"""Sampled motions: what is read is what was written, and every fault is found where it is."""

import csv
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from modrob_cli.errors import InputFileError
from modrob_cli.io import motion_csv
from modrob_cli.io.motion_csv import MotionCsv
from modrob_cli.model.motion import MotionPiece

NAMES = ("base.1", "J #2")
NUMBERED = "t,q1,q2,dq1,dq2,ddq1,ddq2"
ROW = "0,1,2,3,4,5,6"


def read(path: Path, names: tuple[str, ...] = NAMES) -> MotionPiece:
    pieces = list(MotionCsv(path, names))
    return MotionPiece(*(np.concatenate([getattr(p, key) for p in pieces]) for key in ("t", "q", "dq", "ddq")))


def saved(folder: Path, content: str | bytes) -> Path:
    path = folder / "motion.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def fault_of(folder: Path, content: str | bytes, names: tuple[str, ...] = NAMES) -> str:
    with pytest.raises(InputFileError) as caught:
        read(saved(folder, content), names)
    text = str(caught.value).replace(f"{folder}/", "")
    assert text.isprintable() or "\n" in text
    return text


@pytest.mark.parametrize("block", [64, 1000, 2**21])
def test_every_bit_survives_whatever_the_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: int) -> None:
    monkeypatch.setattr(motion_csv, "BLOCK", block)
    rng = np.random.default_rng(1)
    values = rng.normal(size=(300, 7)) * 10.0 ** rng.integers(-300, 300, size=(300, 7))
    values[:, 0] = np.cumsum(rng.uniform(1e-9, 1.0, size=300))
    values[5, 1:] = [5e-324, -5e-324, 1.7976931348623157e308, -0.0, 1e-310, 2.0**-1074]
    with (tmp_path / "motion.csv").open("w", newline="") as stream:
        writer = csv.writer(stream)  # ends lines with CR LF
        writer.writerow(NUMBERED.split(","))
        writer.writerows(values.tolist())
    motion = read(tmp_path / "motion.csv")
    got = np.column_stack([motion.t, motion.q, motion.dq, motion.ddq])
    assert np.array_equal(got.view(np.int64), values.view(np.int64))


def test_columns_by_name_come_in_the_order_of_the_robot(tmp_path: Path) -> None:
    header = '"ddq.J #2",q.J #2,t,q.base.1,dq.base.1,ddq.base.1, dq.J #2 '
    motion = read(saved(tmp_path, f"{header}\n1,2,3,4,5,6,7\n"))
    assert [*motion.t, *motion.q[0], *motion.dq[0], *motion.ddq[0]] == [3, 4, 2, 5, 7, 6, 1]


@pytest.mark.parametrize(
    "text",
    [
        f"{NUMBERED}\n{ROW}",
        f"\ufeff{NUMBERED}\n{ROW}\n",
        f"{NUMBERED}\r\n{ROW}\r\n\r\n",
        f"{NUMBERED}\n\n \n 0 ,1.,+2,3e0,.4e1, 5 ,6E0 \n\n",
    ],
    ids=["no-end-of-line", "bom", "crlf", "blank-lines-and-spaces"],
)
def test_harmless_differences(tmp_path: Path, text: str) -> None:
    motion = read(saved(tmp_path, text))
    assert [*motion.t, *motion.q[0], *motion.dq[0], *motion.ddq[0]] == [0, 1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize(
    ("row", "line", "words"),
    [
        ("1,2,3,4,5,6,nan", 4, "column ddq2: found 'nan', expected a finite number"),
        ("1,2,-inf,4,5,6,7", 4, "column q2: found '-inf', expected a finite number"),
        ("1,2,3,4,1e999,6,7", 4, "column dq2: found '1e999', expected a finite number"),
        ("1,2,3,4,5,six,7", 4, "column ddq1: found 'six', expected a finite number"),
        ("1,2,,4,5,6,7", 4, "column q2: found an empty cell, expected a finite number"),
        ("1,2,3,4,5,6,", 4, "column ddq2: found an empty cell"),
        ("1,1_0,3,4,5,6,7", 4, "column q1: found '1_0'"),
        ("1,0x1,3,4,5,6,7", 4, "column q1: found '0x1'"),
        ("1,\u0661,3,4,5,6,7", 4, "column q1: found '\\u0661'"),
        ("1,\x1b[31m,3,4,5,6,7", 4, "column q1: found '\\x1b[31m'"),
        ("1,\x1e2,3,4,5,6,7", 4, "column q1: found '\\x1e2'"),
        ("1,2 2,3,4,5,6,7", 4, "column q1: found '2 2'"),
        ("1,2,3", 4, "found 3 columns, expected 7 as in the header"),
        ("1,2,3,4,5,6,7,8", 4, "found 8 columns, expected 7"),
        ("1;2;3;4;5;6;7", 4, "found 1 columns, expected 7"),
        ("0.5,2,3,4,5,6,7", 4, "column t: found 0.5, again the time of the sample before"),
        ("0.25,2,3,4,5,6,7", 4, "column t: found 0.25, earlier than the 0.5 of the sample before"),
    ],
)
@pytest.mark.parametrize("block", [16, 40, 2**21])
def test_faulty_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, row: str, line: int, words: str, block: int
) -> None:
    monkeypatch.setattr(motion_csv, "BLOCK", block)
    text = f"{NUMBERED}\n{ROW}\n0.5,1,2,3,4,5,6\n{row}\n9,1,2,3,4,5,6\n"
    message = fault_of(tmp_path, text)
    assert message.startswith(f"motion.csv:{line}: {words}"), message


def test_faults_of_many_lines_come_together(tmp_path: Path) -> None:
    message = fault_of(tmp_path, f"{NUMBERED}\n0,x,2,3,4,y,6\n1,2\n2,1,2,3,4,5,6\n\n3,1,2,3,4,z,6\n")
    assert [line.split(":")[1] for line in message.splitlines()] == ["2", "2", "3", "6"]


def test_short_and_long_lines_do_not_make_up_for_each_other(tmp_path: Path) -> None:
    message = fault_of(tmp_path, f"{NUMBERED}\n0,1,2,3,4,5\n1,1,2,3,4,5,6,7\n")
    assert message.startswith("motion.csv:2: found 6 columns, expected 7")


def test_thousands_of_faults_are_counted(tmp_path: Path) -> None:
    message = fault_of(tmp_path, NUMBERED + "\n" + "0,x,2,3,4,5,6\n" * 3000)
    assert "more faults" in message
    assert len(message.splitlines()) < 150


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("t,q1,q2,dq1,dq2", "found no accelerations, expected the columns ddq1, ddq2 too"),
        ("t,q1,q2", "found no velocities, expected the columns dq1, dq2 too"),
        ("t,q1,q2,dq1,ddq1,ddq2", "the columns dq2 are missing; expected t,q1..q2,dq1..dq2,ddq1..ddq2"),
        ("q1,q2,dq1,dq2,ddq1,ddq2", "the columns t are missing"),
        (f"{NUMBERED},tau1", "found the unknown columns tau1"),
        ("t,q0,q1,dq0,dq1,ddq0,ddq1", "joints count from 1"),
        (f"{NUMBERED},q1", "found repeated columns: q1"),
        (f"{NUMBERED},q3,dq3,ddq3", "found columns for 3 joints, expected 2, in this order: base.1, J #2"),
        ("t,q.A,q.J #2,dq.A,dq.J #2,ddq.A,ddq.J #2", "found the joints A, J #2; the robot has base.1, J #2"),
        ("t,q.base.1,dq.base.1,ddq.base.1", "found the joints base.1; the robot has base.1, J #2"),
        ("t,q.base.1,q.J #2,dq.base.1,dq.J #2", "found no accelerations, expected the columns ddq.base.1, ddq.J #2"),
        ("t,q.base.1,q2,dq.base.1,dq.J #2,ddq.base.1,ddq.J #2", "the columns q.J #2 are missing"),
        (ROW, "found numbers in the first line, expected a header: t,q1..q2"),
        (NUMBERED.replace(",", ";"), "found semicolons between the columns, expected commas"),
        ("modrob: trajectory/1", "found no positions"),
        ("", "found an empty first line, expected a header"),
    ],
)
def test_faulty_header(tmp_path: Path, header: str, words: str) -> None:
    message = fault_of(tmp_path, f"{header}\n{ROW}\n")
    assert message.startswith("motion.csv:1: ")
    assert words in message


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "motion.csv:1: found an empty file"),
        (NUMBERED.encode(), "motion.csv: found no samples"),
        (f"{NUMBERED}\n\n\n".encode(), "motion.csv: found no samples"),
        (f"{NUMBERED}\n{ROW}\n".encode("utf-16"), "motion.csv:1: found the byte 0xff, expected UTF-8"),
        (b"\x89MCAP0\r\n\x00", "motion.csv:1: found the byte 0x89, expected UTF-8"),
        (f"{NUMBERED}\n{ROW}\n1,".encode() + b"\xe9", "motion.csv:3: found the byte 0xe9, expected UTF-8"),
        (f"{NUMBERED}\n".encode() + b"\0" * 3_000_000, "motion.csv:2: found more than 1048576 bytes in one line"),
        (f"{NUMBERED}\n{ROW}\n".replace("\n", "\r").encode(), "motion.csv:1: found lines that end with CR alone"),
        (b"t," + b"q" * 300_000, "motion.csv:1: found a header that is not a line of CSV (field larger"),
        (b"t," + b"q" * 3_000_000, "motion.csv:1: found more than 1048576 bytes in one line"),
    ],
    ids=["empty", "only-header", "blank", "utf-16", "mcap", "latin-1", "zeros", "cr", "long-name", "long-header"],
)
def test_faulty_file(tmp_path: Path, content: bytes, words: str) -> None:
    assert fault_of(tmp_path, content).startswith(words)


def test_places_without_a_file(tmp_path: Path) -> None:
    for path, words in (
        (tmp_path, "found a folder"),
        (tmp_path / "none.csv", "file not found"),
        (Path("/dev/null"), "is not a regular file"),
        (tmp_path / ("n" * 300), "File name too long"),
        (tmp_path / "a\0b", "file not found"),
    ):
        with pytest.raises(InputFileError, match=words):
            read(path)


def test_memory_does_not_grow_with_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = "".join(f"{k}.5,0.1234567890123,2,3,4,5,6\n" for k in range(200_000))
    path = saved(tmp_path, f"{NUMBERED}\n{lines}")
    monkeypatch.setattr(motion_csv, "BLOCK", 2**18)
    tracemalloc.start()
    count = sum(len(piece.t) for piece in MotionCsv(path, NAMES))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count == 200_000
    # The numbers of the whole file take 11 MB; those of a block about twice its 256 KiB, in a few copies.
    assert peak < 4e6
