"""Little-endian fields, written one after the other and read back with clear faults."""

import math
import struct
from dataclasses import dataclass, field
from pathlib import Path

from modrob_cli.errors import Fault, InputFileError


@dataclass
class ByteWriter:
    """Collects fields; ``file`` is the document to blame for values that do not fit."""

    file: str
    raw: bytearray = field(default_factory=bytearray)

    def put(self, form: str, *values: float) -> None:
        """Append values in a :mod:`struct` format such as ``3f``; floats have to stay finite."""
        self.raw += struct.pack("<" + form, *values)

    def put_text(self, text: str, form: str) -> None:
        """Append UTF-8 text behind its length in bytes.

        Raises
        ------
        InputFileError
            If it is too long for the length field.
        """
        encoded = text.encode()
        longest = 256 ** struct.calcsize("<" + form) - 1
        if len(encoded) > longest:
            message = f"found a text of {len(encoded)} bytes, expected at most {longest} for on-module storage"
            raise InputFileError(Fault(self.file, message))
        self.put(form, len(encoded))
        self.raw += encoded


@dataclass
class ByteReader:
    """Reads fields one after the other; ``file`` is the file to blame."""

    file: Path
    raw: bytes
    offset: int = 0

    def fault(self, what: str, message: str) -> InputFileError:
        """An error at the current field."""
        return InputFileError(Fault(str(self.file), message, what))

    def _take(self, size: int, what: str) -> bytes:
        piece = self.raw[self.offset : self.offset + size]
        if len(piece) < size:
            message = f"found the end after {len(self.raw)} bytes, expected {size} more at byte {self.offset}"
            raise self.fault(what, message)
        self.offset += size
        return piece

    def integer(self, form: str, what: str) -> int:
        """One unsigned integer."""
        return int(struct.unpack("<" + form, self._take(struct.calcsize("<" + form), what))[0])

    def floats(self, form: str, what: str) -> list[float]:
        """Finite numbers.

        Raises
        ------
        InputFileError
            If one of them is NaN or infinite.
        """
        start = self.offset
        values = list(struct.unpack("<" + form, self._take(struct.calcsize("<" + form), what)))
        if not all(math.isfinite(value) for value in values):
            raise self.fault(what, f"found {values} at byte {start}, expected finite numbers")
        return values

    def text(self, form: str, what: str) -> str:
        """UTF-8 text behind its length."""
        start = self.offset
        try:
            return self._take(self.integer(form, what), what).decode()
        except UnicodeDecodeError as error:
            raise self.fault(what, f"found bytes that are not UTF-8 at byte {start}") from error

    def choice(self, options: tuple[str, ...], what: str) -> int:
        """One byte that numbers one of the options."""
        value = self.integer("B", what)
        if value >= len(options):
            known = ", ".join(f"{k} ({option})" for k, option in enumerate(options))
            raise self.fault(what, f"found {value} at byte {self.offset - 1}, expected one of: {known}")
        return value
