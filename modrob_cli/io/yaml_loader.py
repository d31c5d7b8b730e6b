"""The one way YAML gets in: safe, bounded, strict about keys, and with the place of every value.

Only plain data can come out (mappings, lists, text, numbers, booleans, null).
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.yaml_builder import Builder, Mark, Path_, first_faults, format_path

MAX_BYTES = 4 * 2**20

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class YamlDocument:
    """A parsed document.

    Attributes
    ----------
    file : the path as the user wrote it
    data : plain Python data
    marks : place in the text (line, column, from 1) of every value and key path
    """

    file: str
    data: Any
    marks: dict[Path_, Mark]

    def fault(self, path: Path_, message: str) -> Fault:
        """Make a fault at a path; the place is that of the nearest parent that is in the text."""
        known = path
        while known and known not in self.marks:
            known = known[:-1]
        line, column = self.marks.get(known, (None, None))
        return Fault(self.file, message, format_path(path), line, column)


def load_yaml(path: Path) -> YamlDocument:
    """Read one YAML document.

    Raises
    ------
    InputFileError
        If the file is missing, not a file, too large, not UTF-8, empty, not one YAML document, uses tags, or
        repeats a key (all repeated keys are listed).
    """
    return parse_yaml(read_text(path), str(path))


def is_folder(path: Path) -> bool:
    """Whether a path is a folder; false, not an error, for one that cannot be looked at."""
    try:
        return path.is_dir()
    except OSError:
        return False


def is_same_file(one: Path, other: Path) -> bool:
    """Whether two paths lead to one existing file, through links too; false where one cannot be looked at."""
    try:
        return one.samefile(other)
    except (OSError, ValueError):
        return False


def read_text(path: Path, max_bytes: int = MAX_BYTES) -> str:
    """Read a text file of bounded size.

    Raises
    ------
    InputFileError
        If it cannot be read, is too large, or is not UTF-8.
    """
    name = str(path)
    try:
        if path.is_dir():
            raise InputFileError(Fault(name, "found a folder, expected a file"))
        if not path.is_file():
            what = "is not a regular file" if path.exists() else "file not found"
            raise InputFileError(Fault(name, f"{what}; check the path"))
        with path.open("rb") as stream:
            raw = stream.read(max_bytes + 1)  # a size on disk may be 0 or out of date
            size = max(len(raw), path.stat().st_size)
        if len(raw) > max_bytes:
            limit = f"found {size / 2**20:.1f} MiB, expected at most {max_bytes / 2**20:.0f} MiB"
            raise InputFileError(Fault(name, f"{limit} for a document; is this the right file?"))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputFileError(Fault(name, f"cannot be read: {reason}")) from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        message = f"found the byte 0x{raw[error.start]:02x}, expected UTF-8 text; save the file as UTF-8"
        raise InputFileError(Fault(name, message, line=line)) from error


def parse_yaml(text: str, file: str) -> YamlDocument:
    """Parse the text of one YAML document; ``file`` names it in messages. Errors as in :func:`load_yaml`."""
    builder = Builder(file)
    try:
        for event in yaml.parse(text, Loader=_LOADER):
            builder.take(event)
    except yaml.MarkedYAMLError as error:
        raise InputFileError(_syntax_fault(error, file, text)) from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        message = f"found character U+{_code(error):04X}, which YAML does not allow"
        raise InputFileError(Fault(file, message, line=line)) from error
    if builder.faults:
        raise InputFileError(first_faults(builder.faults))
    if not builder.has_content:
        raise InputFileError(Fault(file, "found an empty file, expected a YAML document"))
    return YamlDocument(file, builder.root, builder.marks)


def _code(error: yaml.reader.ReaderError) -> int:
    character = error.character
    return character if isinstance(character, int) else ord(str(character)[:1] or "\0")


def _syntax_fault(error: yaml.MarkedYAMLError, file: str, text: str) -> Fault:
    mark = error.problem_mark or error.context_mark
    problem = error.problem or error.context or "not YAML"
    line, column = (mark.line + 1, mark.column + 1) if mark else (None, None)
    rows = text.split("\n", line) if line else []
    row = rows[line - 1] if line and line <= len(rows) else ""
    if "\t" in row[: len(row) - len(row.lstrip())] or "'\\t'" in problem:
        problem = "found a tab in the indentation, expected spaces; replace tabs by spaces"
    else:
        problem = f"not valid YAML: {problem}"
    return Fault(file, problem, line=line, column=column)
