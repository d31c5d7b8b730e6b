"""Sampled motions as CSV: ``t,q1..qN,dq1..dqN,ddq1..ddqN``, or ``q.NAME`` and so on; read piece by piece.

A piece is parsed by NumPy at once; only if that does not work out it is read line by line, to say where and why.
"""

import csv
import re
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.motion_header import column_order
from modrob_cli.io.yaml_builder import first_faults, shorten
from modrob_cli.model.motion import MotionPiece

BLOCK = 2 * 2**20
"""Bytes that are read at once; memory does not grow with the file."""
LONGEST_LINE = 2**20

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_SPACE = " \t\r\f\v"  # what NumPy skips around numbers
_BOM = b"\xef\xbb\xbf"


class MotionCsv:
    """A motion file, to be iterated over once; gives pieces with columns in the order of the robot's joints.

    Attributes
    ----------
    done : fraction of the file that was read so far
    """

    def __init__(self, path: Path, joint_names: Sequence[str]) -> None:
        self.path = path
        self.joint_names = tuple(joint_names)
        self.done = 0.0

    def __iter__(self) -> Iterator[MotionPiece]:
        """Read the file.

        Raises
        ------
        InputFileError
            If it cannot be read, its columns do not fit the robot, something in it is not a finite number, its
            times do not increase, or it has no samples; possibly after the pieces before the fault were given.
        """
        with open_csv(self.path) as stream:
            yield from self._pieces(stream, max(self.path.stat().st_size, 1))

    def _pieces(self, stream: BinaryIO, size: int) -> Iterator[MotionPiece]:
        header = read_header(str(self.path), stream)
        order = column_order(str(self.path), header, self.joint_names)
        table = NumberTable(str(self.path), header)
        n = len(self.joint_names)
        for lines, values in table.blocks(stream):
            values = values[:, order]
            table.check_times(lines, values[:, 0])
            self.done = min(stream.tell() / size, 1.0)
            yield MotionPiece(values[:, 0], *(values[:, 1 + k * n : 1 + (k + 1) * n] for k in range(3)))
        if table.last_time is None:
            message = "found no samples, expected at least one line of numbers after the header"
            raise InputFileError(Fault(str(self.path), message))


def open_csv(path: Path) -> BinaryIO:
    """Open a file.

    Raises
    ------
    InputFileError
        If it is none or cannot be opened.
    """
    name = str(path)
    try:
        if path.is_dir():
            raise InputFileError(Fault(name, "found a folder, expected a CSV file"))
        if not path.is_file():
            what = "is not a regular file" if path.exists() else "file not found"
            raise InputFileError(Fault(name, f"{what}; check the path"))
        return path.open("rb")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputFileError(Fault(name, f"cannot be read: {reason}")) from error


def read_header(name: str, stream: BinaryIO) -> list[str]:
    """Names of the columns, from the first line.

    Raises
    ------
    InputFileError
        If it is no header.
    """
    raw = stream.readline(LONGEST_LINE).removeprefix(_BOM)
    if not raw.strip():
        what = "an empty first line" if raw else "an empty file"
        raise InputFileError(Fault(name, f"found {what}, expected a header: t,q1,...,dq1,...,ddq1,...", line=1))
    if len(raw) >= LONGEST_LINE:
        message = f"found more than {LONGEST_LINE} bytes in one line, expected a header: t,q1,..."
        raise InputFileError(Fault(name, message, line=1))
    text = _decoded(name, raw, 1).strip()
    if "\r" in text:
        message = "found lines that end with CR alone, expected LF or CR LF; save the file with other line ends"
        raise InputFileError(Fault(name, message, line=1))
    try:
        return [cell.strip() for cell in next(csv.reader([text], skipinitialspace=True))]
    except csv.Error as error:
        message = f"found a header that is not a line of CSV ({error}), expected t,q1,...,dq1,...,ddq1,..."
        raise InputFileError(Fault(name, message, line=1)) from error


class NumberTable:
    """Lines of numbers below a header."""

    def __init__(self, file: str, header: list[str]) -> None:
        self.file = file
        self.header = header
        self.last_time: float | None = None
        self._line = 2

    def blocks(self, stream: BinaryIO) -> Iterator[tuple[Indices, Array]]:
        """Line numbers (T,) and numbers (T, columns) of each block that is not empty."""
        rest = b""
        while block := stream.read(BLOCK):
            head, newline, tail = block.rpartition(b"\n")
            if newline:
                yield from self._parse(rest + head)
                rest = tail
            else:
                rest += block
            if len(rest) > LONGEST_LINE:
                message = f"found more than {LONGEST_LINE} bytes in one line, expected a line of numbers"
                raise InputFileError(Fault(self.file, message, line=self._line))
        if rest:
            yield from self._parse(rest)

    def _parse(self, text: bytes) -> Iterator[tuple[Indices, Array]]:
        count = text.count(b"\n") + 1
        lines = np.arange(self._line, self._line + count, dtype=np.intp)
        values = self._parse_at_once(text, count)
        if values is None:
            lines, values = self._parse_by_line(text)
        self._line += count
        if len(values):
            yield lines, values

    def _parse_at_once(self, text: bytes, count: int) -> Array | None:
        """Numbers (count, columns) of lines without any fault or blank line; else None."""
        raw = np.frombuffer(text, dtype=np.uint8)
        ends = raw[(raw == ord(",")) | (raw == ord("\n"))] == ord("\n")
        width = len(self.header)
        is_regular = len(ends) == count * width - 1 and ends[width - 1 :: width].all() and ends.sum() == count - 1
        if not is_regular:
            return None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)  # how NumPy before 2.3 says that it stopped early
                values = np.fromstring(text.replace(b"\n", b","), dtype=float, sep=",")
        except (ValueError, DeprecationWarning):
            return None
        if len(values) != count * width or not np.isfinite(values).all():
            return None
        return np.asarray(values.reshape(count, width))

    def _parse_by_line(self, text: bytes) -> tuple[Indices, Array]:
        """Line numbers and numbers of the lines that are not blank.

        Raises
        ------
        InputFileError
            With the faults of all lines.
        """
        faults: list[Fault] = []
        lines: list[int] = []
        rows: list[list[float]] = []
        for line, raw in enumerate(text.split(b"\n"), start=self._line):
            cells = _decoded(self.file, raw, line).strip(_SPACE).split(",")
            if cells == [""]:
                continue
            if len(cells) != len(self.header):
                message = f"found {len(cells)} columns, expected {len(self.header)} as in the header"
                faults.append(Fault(self.file, message, line=line))
                continue
            row = [_number(cell) for cell in cells]
            for column, cell, value in zip(self.header, cells, row, strict=True):
                if value is None:
                    found = shorten(cell.strip(_SPACE)) if cell.strip(_SPACE) else "an empty cell"
                    message = f"found {found}, expected a finite number"
                    faults.append(Fault(self.file, message, f"column {column}", line))
            lines.append(line)
            rows.append([value if value is not None else 0.0 for value in row])
        if faults:
            raise InputFileError(first_faults(faults))
        return np.array(lines, dtype=np.intp), np.array(rows, dtype=float).reshape(len(rows), len(self.header))

    def check_times(self, lines: Indices, t: Array) -> None:
        """Make sure that times (T,) go on from the block before and increase strictly.

        Raises
        ------
        InputFileError
            At the first line where they do not.
        """
        before = np.concatenate([[-np.inf if self.last_time is None else self.last_time], t[:-1]])
        wrong = np.flatnonzero(t <= before)
        if len(wrong):
            k = int(wrong[0])
            again = t[k] == before[k]
            what = "again the time of" if again else f"earlier than the {float(before[k])!r} of"
            advice = "leave out repeated samples" if again else "sort the samples"
            message = f"found {float(t[k])!r}, {what} the sample before; expected times that increase: {advice}"
            raise InputFileError(Fault(self.file, message, "column t", int(lines[k])))
        self.last_time = float(t[-1])


def _number(cell: str) -> float | None:
    """A finite decimal number, or None."""
    text = cell.strip(_SPACE)
    if not _NUMBER.fullmatch(text):
        return None
    value = float(text)
    return value if np.isfinite(value) else None


def _decoded(file: str, raw: bytes, line: int) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        message = f"found the byte 0x{raw[error.start]:02x}, expected UTF-8 text; is this a CSV file?"
        raise InputFileError(Fault(file, message, line=line)) from error
