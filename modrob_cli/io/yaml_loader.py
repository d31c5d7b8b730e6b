"""The one way YAML gets in: safe, bounded, strict about keys, and with the place of every value.

Only plain data can come out (mappings, lists, text, numbers, booleans, null). The document is built from the
parser's events with an explicit stack, so that neither deep nesting nor aliases that multiply can exhaust the
process.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.yaml_scalars import Scalar, plain_scalar

MAX_BYTES = 4 * 2**20
MAX_DEPTH = 40
MAX_NODES = 400_000

Path_ = tuple[str | int, ...]
Mark = tuple[int, int]

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
        """A fault at a path; the place is that of the nearest parent that is in the text."""
        known = path
        while known and known not in self.marks:
            known = known[:-1]
        line, column = self.marks.get(known, (None, None))
        return Fault(self.file, message, format_path(path), line, column)


def format_path(path: Path_) -> str:
    """Write a path as ``$.joints[1].limits``."""
    return "$" + "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)


def load_yaml(path: Path) -> YamlDocument:
    """Read one YAML document.

    Raises
    ------
    InputFileError
        If the file is missing, not a file, too large, not UTF-8, empty, not one YAML document, uses tags, or
        repeats a key (all repeated keys are listed).
    """
    return parse_yaml(read_text(path), str(path))


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
        size = path.stat().st_size
        if size > max_bytes:
            limit = f"found {size / 2**20:.1f} MiB, expected at most {max_bytes / 2**20:.0f} MiB"
            raise InputFileError(Fault(name, f"{limit} for a document; is this the right file?"))
        raw = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputFileError(Fault(name, f"cannot be read: {reason}")) from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        message = f"found byte 0x{raw[error.start]:02x}, expected UTF-8 text; save the file as UTF-8"
        raise InputFileError(Fault(name, message, line=line)) from error


def parse_yaml(text: str, file: str) -> YamlDocument:
    """Parse the text of one YAML document; ``file`` names it in messages. Errors as in :func:`load_yaml`."""
    builder = _Builder(file)
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
        raise InputFileError(builder.faults)
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
    row = text.splitlines()[line - 1] if line and line <= len(text.splitlines()) else ""
    if "\t" in row[: len(row) - len(row.lstrip())] or "'\\t'" in problem:
        problem = "found a tab in the indentation, expected spaces; replace tabs by spaces"
    else:
        problem = f"not valid YAML: {problem}"
    return Fault(file, problem, line=line, column=column)


@dataclass
class _Open:
    """A mapping or list that is still being filled."""

    value: dict[str, Any] | list[Any]
    path: Path_
    mark: Mark
    key: str | None = None
    anchor: str | None = None


@dataclass
class _Builder:
    """Turns parser events into data, marks and faults."""

    file: str
    root: Any = None
    has_content: bool = False
    marks: dict[Path_, Mark] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, tuple[Any, int]] = field(default_factory=dict)
    documents: int = 0
    nodes: int = 0

    def take(self, event: yaml.Event) -> None:
        """Process one event."""
        mark = (event.start_mark.line + 1, event.start_mark.column + 1)
        if isinstance(event, yaml.DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                self._stop("found a second document ('---'), expected one document per file", mark)
        elif isinstance(event, yaml.ScalarEvent):
            self._check_tag(event.tag, event.implicit[0] or event.implicit[1], mark)
            value: Scalar = plain_scalar(event.value) if event.implicit[0] else event.value
            self._add(value, mark, event.anchor, size=1)
        elif isinstance(event, yaml.AliasEvent):
            if event.anchor not in self.anchors:
                self._stop(f"found alias *{event.anchor} of an anchor that is not complete above it", mark)
            value, size = self.anchors[event.anchor]
            self._add(value, mark, None, size)
        elif isinstance(event, yaml.MappingStartEvent | yaml.SequenceStartEvent):
            self._check_tag(event.tag, event.implicit, mark)
            self._open({} if isinstance(event, yaml.MappingStartEvent) else [], mark, event.anchor)
        elif isinstance(event, yaml.MappingEndEvent | yaml.SequenceEndEvent):
            closed = self.stack.pop()
            if closed.anchor:
                self.anchors[closed.anchor] = (closed.value, _size(closed.value))
            self._add(closed.value, closed.mark, None, size=0)

    def _stop(self, message: str, mark: Mark) -> None:
        raise InputFileError([*self.faults, Fault(self.file, message, line=mark[0], column=mark[1])])

    def _check_tag(self, tag: str | None, implicit: bool, mark: Mark) -> None:
        if tag is not None and not implicit or tag == "!":
            self._stop(f"found the tag {tag}, expected plain data; remove the tag", mark)

    def _next_path(self) -> Path_:
        if not self.stack:
            return ()
        top = self.stack[-1]
        return (*top.path, len(top.value) if isinstance(top.value, list) else top.key or "")

    def _open(self, value: dict[str, Any] | list[Any], mark: Mark, anchor: str | None) -> None:
        if len(self.stack) >= MAX_DEPTH:
            self._stop(f"found nesting deeper than {MAX_DEPTH} levels", mark)
        if self._expects_key():
            self._stop("found a list or mapping as a key, expected text", mark)
        self.stack.append(_Open(value, self._next_path(), mark, anchor=anchor))

    def _expects_key(self) -> bool:
        return bool(self.stack) and isinstance(self.stack[-1].value, dict) and self.stack[-1].key is None

    def _add(self, value: Any, mark: Mark, anchor: str | None, size: int) -> None:
        self.nodes += size
        if self.nodes > MAX_NODES:
            self._stop(f"found more than {MAX_NODES} values once aliases are expanded", mark)
        if anchor:
            self.anchors[anchor] = (value, size)
        if self._expects_key():
            self._take_key(value, mark)
            return
        path = self._next_path()
        self.marks.setdefault(path, mark)
        if not self.stack:
            self.root, self.has_content = value, value is not None
            return
        top = self.stack[-1]
        if isinstance(top.value, list):
            top.value.append(value)
        else:
            top.value[top.key or ""] = value
            top.key = None

    def _take_key(self, key: Any, mark: Mark) -> None:
        top = self.stack[-1]
        if not isinstance(key, str):
            key = "null" if key is None else str(key)
        if isinstance(top.value, dict) and key in top.value:
            path = format_path((*top.path, key))
            first = self.marks.get((*top.path, key), (0, 0))[0]
            message = f"found the key {key!r} again (first on line {first}), expected each key once"
            self.faults.append(Fault(self.file, message, path, *mark))
        top.key = key
        self.marks.setdefault((*top.path, key), mark)


def _size(value: Any) -> int:
    """Number of scalars in plain data, shared parts counted each time they appear (data are bounded here)."""
    if isinstance(value, dict):
        return sum(_size(item) for item in value.values()) + 1
    if isinstance(value, list):
        return sum(_size(item) for item in value) + 1
    return 1
