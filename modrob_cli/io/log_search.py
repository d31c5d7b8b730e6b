"""Logs in folders and by glob patterns on this machine, in a natural order, each once."""

import fnmatch
import os
import re
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

LOG_SUFFIX = ".mcap"
_OWN = re.compile(r"\.(validate|identify|collision)(\.(logs|events))?\.(mcap|csv|parquet)$", re.IGNORECASE)
"""Names of files that modrob writes beside its results; nobody means them by a folder of logs."""

Key = tuple[tuple[str | int, ...], ...]


def natural_key(path: str) -> tuple[Key, str]:
    """Sort key that puts run_2 before run_10, folder by folder, whatever the case of the letters."""
    pieces = (re.split("([0-9]+)", part.casefold()) for part in path.split("/"))
    # The pieces between numbers are text and every second one is a number, so that keys can be compared.
    return tuple(tuple(int(text) if k % 2 else text for k, text in enumerate(parts)) for parts in pieces), path


def has_magic(pattern: str) -> bool:
    """Whether a text is a glob pattern."""
    return any(sign in pattern for sign in "*?[")


def is_own_output(name: str) -> bool:
    """Whether a file is named like one that modrob writes, such as ``run.collision.mcap``."""
    return _OWN.search(name) is not None


def is_named_like_a_log(path: Path) -> bool:
    """Whether somebody looking at its name takes it for a log."""
    return path.name.lower().endswith(LOG_SUFFIX)


def wanted_in_folder(name: str) -> bool:
    """Whether a file in a folder is one of its logs: by its ending, neither hidden nor one of modrob's outputs."""
    return name.lower().endswith(LOG_SUFFIX) and not name.startswith(".") and not is_own_output(name)


def search_folder(folder: Path) -> list[str]:
    """All MCAP files in a folder and below it, in natural order.

    Links to folders are followed, each folder is entered once, and a link never leads up to a folder around the one
    that is searched. A folder that cannot be entered is part of the result, as is an empty one that is named like a
    log: as a log it fails, with its name.
    """
    found: list[tuple[bool, str]] = []
    for path, entries in _folders([folder]):
        if entries is None or (not entries and is_named_like_a_log(path)):
            found.append((False, str(path)))
        else:
            wanted = (entry for entry in entries if wanted_in_folder(entry.name) and not is_folder(entry))
            found += [(entry.is_symlink(), str(path / entry.name)) for entry in wanted]
    # Of a file and a link to it the file stays.
    found.sort(key=lambda pair: pair[0])
    return sorted(once(path for _, path in found), key=natural_key)


def search_glob(pattern: str) -> list[str]:
    """What matches a pattern, in natural order: files as in a shell, folders with the MCAP files in and below them.

    ``**`` stands for a folder and all below it, links as in :func:`search_folder`. Hidden files are matched by patterns
    with the dot only, and modrob's own outputs by patterns that name their kind only, as in ``*.collision.mcap``.
    """
    *parts, last = [part for part in pattern.split("/") if part]
    failed: list[Path] = []
    level = [Path("/" if pattern.startswith("/") else "")]
    for part in parts:
        level = [path for path in _step(level, part, failed) if is_folder(path)]
    matches = level if last == "**" else _step(level, last, failed)
    named = is_own_output(re.sub(r"[*?\[\]]+", "x", last))
    found = [str(path) for path in failed]
    for path in matches:
        if is_folder(path):
            found += search_folder(path)
        elif not pattern.endswith("/") and (named or not is_own_output(path.name)):
            found.append(str(path))
    return sorted(once(found), key=natural_key)


def once(paths: Iterable[str], identity: Callable[[str], str] = os.path.realpath) -> list[str]:
    """The same without repetitions of a file, the first of each kept."""
    seen: dict[str, str] = {}
    for path in paths:
        seen.setdefault(identity(path), path)
    return list(seen.values())


def is_folder(path: "Path | os.DirEntry[str]") -> bool:
    """Whether a path is a folder that can be looked at."""
    try:
        return path.is_dir()
    except OSError:  # no permission, a link to itself
        return False


def _step(level: Sequence[Path], part: str, failed: list[Path]) -> list[Path]:
    """One part of a pattern: paths one level deeper; folders that cannot be entered go to ``failed``."""
    if part == "**":
        below = list(_folders(level))
        failed += [path for path, entries in below if entries is None]
        return [path for path, entries in below if entries is not None]
    if not has_magic(part):
        return [path for path in (folder / part for folder in level) if os.path.lexists(path)]
    matches = re.compile(fnmatch.translate(part)).match
    found: list[Path] = []
    for folder in level:
        try:
            inside = sorted(folder.iterdir())
        except OSError:
            failed.append(folder)
            continue
        shown = (path for path in inside if part.startswith(".") or not path.name.startswith("."))
        found += [path for path in shown if matches(path.name)]
    return found


def _folders(tops: Sequence[Path]) -> Iterator[tuple[Path, "list[os.DirEntry[str]] | None"]]:
    """Folders at and below some, each once, with what is in them; None where that cannot be read."""
    seen = _around(tops)
    waiting, linked = list(reversed(tops)), deque[Path]()
    while waiting or linked:
        # Folders come first by their own name, by the name of a link only if there is no other.
        folder = waiting.pop() if waiting else linked.popleft()
        try:
            identity = _identity(folder)
            if identity in seen:
                continue
            seen.add(identity)
            with os.scandir(folder) as found:
                entries = sorted((e for e in found if not e.name.startswith(".")), key=lambda e: e.name)
        except OSError:
            yield folder, None
            continue
        for entry in entries:
            if is_folder(entry):
                (linked if entry.is_symlink() else waiting).append(folder / entry.name)
        yield folder, entries


def _identity(folder: Path) -> tuple[int, int]:
    status = folder.stat()
    return status.st_dev, status.st_ino


def _around(tops: Sequence[Path]) -> set[tuple[int, int]]:
    """Identities of the folders around some, up to the root; those inside another of them left out."""
    real = {Path(os.path.realpath(top)) for top in tops}
    found: set[tuple[int, int]] = set()
    for top in real:
        if real.isdisjoint(top.parents):
            with suppress(OSError):
                found.update(_identity(above) for above in top.parents)
    return found
