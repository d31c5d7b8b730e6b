"""Long tables of numbers as CSV, written piece by piece; every double keeps all its bits."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self, TextIO

from modrob_cli.arrays import Array
from modrob_cli.errors import OutputError
from modrob_cli.io.csv_writer import csv_text


class NumberCsv:
    """A CSV file that is open for writing while the ``with`` block lasts.

    Raises
    ------
    OutputError
        If it cannot be written.
    """

    def __init__(self, path: Path, header: Sequence[str]) -> None:
        self.path = path
        self.header = header
        self._stream: TextIO | None = None

    def __enter__(self) -> Self:
        """Open the file and write the header."""
        try:
            self._stream = self.path.open("w", encoding="utf-8", newline="")
        except OSError as error:
            raise OutputError(f"cannot write into {self.path.parent}: {error.strerror}") from error
        self._write(csv_text(self.header, []))
        return self

    def write(self, rows: Array) -> None:
        """Append rows, shape (T, columns); numbers as Python's repr gives them, the shortest that reads back equal."""
        self._write("".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()))

    def _write(self, text: str) -> None:
        if self._stream is None:
            raise ValueError("the file is not open")
        try:
            self._stream.write(text)
        except OSError as error:
            raise OutputError(f"cannot write into {self.path.parent}: {error.strerror}") from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        if self._stream is None:
            return
        try:
            self._stream.close()
        except OSError as closing:
            raise OutputError(f"cannot write into {self.path.parent}: {closing.strerror}") from closing
