"""Plain data and places from the events of a YAML parser.

Built with an explicit stack, so that neither deep nesting nor aliases that multiply can exhaust the process.
"""

import re
from dataclasses import dataclass, field
from typing import Any

import yaml

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.yaml_scalars import plain_scalar

MAX_DEPTH = 40
MAX_NODES = 100_000
MAX_FAULTS = 100

Path_ = tuple[str | int, ...]
Mark = tuple[int, int]

_PLAIN_KEY = re.compile(r"[A-Za-z0-9_#/+-]{1,64}\Z")
_UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters, lone surrogates, and marks that turn the direction of text: they would reach terminals,
tables and XML. Tab and line feed are text."""


def format_path(path: Path_) -> str:
    """Write a path as ``$.joints[1].limits``; keys that are no plain words are quoted and cut."""
    return "$" + "".join(_format_step(part) for part in path)


def _format_step(part: str | int) -> str:
    if isinstance(part, int):
        return f"[{part}]"
    return f".{part}" if _PLAIN_KEY.match(part) else f"[{shorten(part)}]"


def shorten(text: str, most: int = 60) -> str:
    """Quote text for a message: ASCII only, bounded in length."""
    return ascii(text) if len(text) <= most else ascii(text[:most]) + "..."


def first_faults(faults: list[Fault]) -> list[Fault]:
    """Faults up to a number that a person reads, and one that counts the rest."""
    rest = len(faults) - MAX_FAULTS
    if rest <= 0:
        return faults
    return [*faults[:MAX_FAULTS], Fault(faults[0].file, f"found {rest} more faults, which are not listed")]


@dataclass(frozen=True)
class _Node:
    """A finished value, the number of values in it, and its levels of nesting (0 for a scalar)."""

    value: Any
    size: int = 1
    depth: int = 0


@dataclass
class _Open:
    """A mapping or list that is still being filled; size and depth count aliased parts each time they appear."""

    value: dict[str, Any] | list[Any]
    path: Path_
    mark: Mark
    key: str | None = None
    anchor: str | None = None
    size: int = 1
    depth: int = 1


@dataclass
class Builder:
    """Turns parser events into data, marks and faults."""

    file: str
    root: Any = None
    has_content: bool = False
    marks: dict[Path_, Mark] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, _Node] = field(default_factory=dict)
    documents: int = 0
    nodes: int = 0

    def take(self, event: yaml.Event) -> None:
        """Process one event."""
        mark = (event.start_mark.line + 1, event.start_mark.column + 1) if event.start_mark else (1, 1)
        if isinstance(event, yaml.DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                self._stop("found a second document ('---'), expected one document per file", mark)
        elif isinstance(event, yaml.ScalarEvent):
            self._check_tag(event.tag, event.implicit[0] or event.implicit[1], mark)
            unsafe = _UNSAFE.search(event.value)
            if unsafe:
                message = f"found the character U+{ord(unsafe[0]):04X} in text, expected printable text"
                self.faults.append(Fault(self.file, message, format_path(self._next_path()), *mark))
            value = plain_scalar(event.value) if event.implicit[0] else event.value
            self._count(1, mark)
            self._add(_Node(value), mark, event.anchor)
        elif isinstance(event, yaml.AliasEvent):
            self._repeat(event.anchor or "", mark)
        elif isinstance(event, yaml.MappingStartEvent | yaml.SequenceStartEvent):
            self._check_tag(event.tag, event.implicit, mark)
            self._count(1, mark)
            self._open({} if isinstance(event, yaml.MappingStartEvent) else [], mark, event.anchor)
        elif isinstance(event, yaml.MappingEndEvent | yaml.SequenceEndEvent):
            closed = self.stack.pop()
            self._add(_Node(closed.value, closed.size, closed.depth), closed.mark, closed.anchor)

    def _repeat(self, anchor: str, mark: Mark) -> None:
        if anchor not in self.anchors:
            self._stop(f"found the alias {shorten(anchor)} of an anchor that is not complete above it", mark)
        node = self.anchors[anchor]
        if len(self.stack) + node.depth > MAX_DEPTH:
            self._stop(f"found nesting deeper than {MAX_DEPTH} levels once aliases are expanded", mark)
        if node.depth and self._expects_key():
            self._stop("found a list or mapping as a key, expected text", mark)
        self._count(node.size, mark)
        self._add(node, mark, None)

    def _count(self, size: int, mark: Mark) -> None:
        self.nodes += size
        if self.nodes > MAX_NODES:
            self._stop(f"found more than {MAX_NODES} values once aliases are expanded", mark)

    def _stop(self, message: str, mark: Mark) -> None:
        raise InputFileError([*self.faults, Fault(self.file, message, line=mark[0], column=mark[1])])

    def _check_tag(self, tag: str | None, implicit: bool, mark: Mark) -> None:
        if tag is not None and not implicit or tag == "!":
            self._stop(f"found the tag {shorten(str(tag))}, expected plain data; remove the tag", mark)

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

    def _add(self, node: _Node, mark: Mark, anchor: str | None) -> None:
        if anchor:
            self.anchors[anchor] = node
        if self._expects_key():
            self._take_key(node.value, mark)
            return
        self.marks.setdefault(self._next_path(), mark)
        if not self.stack:
            self.root, self.has_content = node.value, node.value is not None
            return
        top = self.stack[-1]
        top.size += node.size
        top.depth = max(top.depth, node.depth + 1)
        if isinstance(top.value, list):
            top.value.append(node.value)
        else:
            top.value[top.key or ""] = node.value
            top.key = None

    def _take_key(self, key: Any, mark: Mark) -> None:
        top = self.stack[-1]
        if not isinstance(key, str):
            key = "null" if key is None else str(key)
        if isinstance(top.value, dict) and key in top.value:
            path = format_path((*top.path, key))
            first = self.marks.get((*top.path, key), (0, 0))[0]
            message = f"found the key {shorten(key)} again (first on line {first}), expected each key once"
            self.faults.append(Fault(self.file, message, path, *mark))
        top.key = key
        self.marks.setdefault((*top.path, key), mark)
