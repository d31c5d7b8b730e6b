"""Logs as CSV: ``t,q1..qN,dq1..dqN,effort1..effortN``, or ``q.NAME`` and so on; ``t`` first, in seconds.

Times are read and written as whole nanoseconds, numbers with all their bits, an empty cell where there is no value:
what is written reads back equal.
"""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import BinaryIO

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.cdr_layout import Stamps
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.io.log_csv_columns import KINDS, LogColumns
from modrob_cli.model.log import Recording

_TIME = re.compile(rb"\s*([0-9]{1,10})(?:\.([0-9]{1,9}))?\s*")
_CUT_NUMBER = re.compile(rb"\s*[-+]?(\d*\.?\d*[eE][-+]?|\.?)")
_LONGEST_LINE = 2**20
_LINES = 10_000
_LATEST = 9e9
"""Times must be below this [s]: nanoseconds then fit into 64 bits."""
_BOM = b"\xef\xbb\xbf"


def read_log_csv(
    path: Path,
    joint_names: Sequence[str] | None = None,
    joint_map: Mapping[str, str] | None = None,
    strict: bool = False,
) -> Recording:
    """Read a log.

    Parameters
    ----------
    joint_names : joints that are wanted, in this order; numbered columns are theirs. None: those of the file
    joint_map : names of joints in the file and what the robot calls them
    strict : refuse a file whose last line is cut, instead of leaving it out

    Raises
    ------
    InputFileError
        If it cannot be read, its columns are not those of a log, joints are missing, something is no number, or times
        go back.
    """
    name = str(path)
    try:
        if not path.is_file():
            what = "found a folder" if path.is_dir() else "file not found"
            raise InputFileError(Fault(name, f"{what}; expected a CSV file"))
        with path.open("rb") as stream:
            columns = LogColumns(name, _header(name, stream), joint_names, joint_map or {})
            parts = list(_parts(name, stream, columns))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputFileError(Fault(name, f"cannot be read: {reason}")) from error
    if not parts:
        raise InputFileError(Fault(name, "found no samples, expected lines of numbers after the header"))
    if strict and columns.cut:
        raise InputFileError(Fault(name, "--strict refuses a file that is damaged: the last line is cut"))
    return _recording(path, columns, parts)


def _header(file: str, stream: BinaryIO) -> list[str]:
    raw = stream.readline(_LONGEST_LINE).removeprefix(_BOM)
    try:
        cells = next(csv.reader([raw.decode().strip()], skipinitialspace=True), [])
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputFileError(Fault(file, f"found a header that is not a line of CSV ({error})", line=1)) from error
    if not cells:
        what = "an empty first line" if raw else "an empty file"
        raise InputFileError(Fault(file, f"found {what}, expected a header: t,q1,..", line=1))
    return [cell.strip() for cell in cells]


def _parts(file: str, stream: BinaryIO, columns: LogColumns) -> Iterator[tuple[Stamps, Stamps, Array]]:
    """Line numbers, times [ns] and numbers (T, columns - 1) piece by piece."""
    lines: list[bytes] = []
    numbers: list[int] = []
    line = 1
    while raw := stream.readline(_LONGEST_LINE):
        line += 1
        if len(raw) >= _LONGEST_LINE:
            raise InputFileError(Fault(file, f"found more than {_LONGEST_LINE} bytes in one line", line=line))
        if not raw.endswith(b"\n") and _is_cut(raw, columns.count):
            columns.cut = True
        elif raw.strip():
            lines.append(raw)
            numbers.append(line)
        if len(lines) == _LINES:
            yield _parse(file, lines, numbers, columns.count)
            lines, numbers = [], []
    if lines:
        yield _parse(file, lines, numbers, columns.count)


def _is_cut(raw: bytes, count: int) -> bool:
    """Whether the last line of a file, which has no line end, lacks columns or the end of a number."""
    cells = raw.split(b",")
    return bool(raw.strip()) and (len(cells) < count or _CUT_NUMBER.fullmatch(cells[-1]) is not None)


def _parse(file: str, lines: list[bytes], numbers: list[int], count: int) -> tuple[Stamps, Stamps, Array]:
    faults: list[Fault] = []
    times = np.zeros(len(lines), dtype=np.int64)
    values = np.full((len(lines), count - 1), np.nan)
    for k, raw in enumerate(lines):
        cells = raw.split(b",")
        if len(cells) != count:
            faults.append(
                Fault(file, f"found {len(cells)} columns, expected {count} as in the header", line=numbers[k])
            )
            continue
        try:
            times[k] = _nanoseconds(cells[0])
            values[k] = [float(cell) if cell.strip() else np.nan for cell in cells[1:]]
        except (ValueError, ArithmeticError):
            faults.append(Fault(file, "found a cell that is no number (or a time out of range)", line=numbers[k]))
        if len(faults) == 20:
            break
    if faults:
        raise InputFileError(faults)
    return np.array(numbers, dtype=np.int64), times, values


def _nanoseconds(cell: bytes) -> int:
    """Whole nanoseconds of a decimal number of seconds, rounded to the nearest.

    Raises
    ------
    ValueError
        If it is no number or out of range; an ArithmeticError if Decimal says so.
    """
    match = _TIME.fullmatch(cell)
    if match:
        return int(match[1]) * 1_000_000_000 + int((match[2] or b"").ljust(9, b"0"))
    if not abs(float(cell)) < _LATEST:
        raise ValueError("out of range")
    return int((Decimal(cell.decode().strip()) * 1_000_000_000).to_integral_value())


def _recording(path: Path, columns: LogColumns, parts: list[tuple[Stamps, Stamps, Array]]) -> Recording:
    lines, stamps, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    steps = np.diff(stamps)
    if np.any(steps < 0):
        k = int(np.argmax(steps < 0))
        message = f"found a time {-steps[k] / 1e9:.9g} s before that of the line before; expected times that increase"
        raise InputFileError(Fault(str(path), message, "column t", int(lines[k + 1])))
    kept = np.flatnonzero(np.append(True, steps > 0))
    repeated = len(stamps) - len(kept)
    if len(kept) < 2:
        raise InputFileError(Fault(str(path), f"found {len(kept)} time, expected 2 or more samples with their times"))
    notes = [f"ignored joints of the log: {', '.join(columns.ignored)}"] if columns.ignored else []
    if columns.cut:
        notes.append("damaged: the last line is cut and was left out")
    if repeated:
        notes.append(f"{repeated} lines repeated the time before and were left out")
    arrays = []
    for kind in KINDS:
        table = np.full((len(kept), len(columns.names)), np.nan)
        for j, place in enumerate(columns.places[kind]):
            if place >= 0:
                table[:, j] = values[kept, place]
        arrays.append(table)
    dq, effort = (None if np.isnan(table).all() else table for table in arrays[1:])
    found = (columns.names, stamps[kept], arrays[0], dq, effort, repeated, tuple(notes))
    return Recording(path.stem, "", "header", *found)


def write_log_csv(path: Path, recording: Recording) -> None:
    """Write a log: ``t``, then ``q.NAME`` of all joints, then ``dq.NAME`` and ``effort.NAME`` where they are known.

    Raises
    ------
    UsageError
        If it cannot be written.
    """
    tables = {kind: table for kind in KINDS if (table := getattr(recording, kind)) is not None}
    header = ["t", *(f"{kind}.{name}" for kind in tables for name in recording.joint_names)]
    try:
        with path.open("w", encoding="utf-8", newline="") as stream:
            stream.write(csv_text(header, []))
            for first in range(0, len(recording.stamps), _LINES):
                span = slice(first, first + _LINES)
                rows = np.concatenate([table[span] for table in tables.values()], axis=1).tolist()
                times = recording.stamps[span].tolist()
                stream.write("".join(_line(time, row) for time, row in zip(times, rows, strict=True)))
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror or error}") from error


def _line(time: int, row: list[float]) -> str:
    cells = [repr(value) if value == value else "" for value in row]
    sign, size = ("-", -time) if time < 0 else ("", time)
    return f"{sign}{size // 10**9}.{size % 10**9:09d},{','.join(cells)}\n"
