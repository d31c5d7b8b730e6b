"""Which logs are meant: files, folders, globs, URLs and lists of them; each as a local file, each with a name."""

import os
import stat
import sys
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import urlsplit, urlunsplit

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.log_search import has_magic, is_folder, once, search_folder, search_glob
from modrob_cli.io.log_urls import fetched, find_urls, is_url, local_path, url_name

_LONGEST_NAME = 180
"""Bytes of a log's name, so that its files' names fit into the 255 that file systems take."""


@dataclass(frozen=True)
class _Entry:
    """One argument, and where a list has it."""

    text: str
    file: str | None = None
    line: int | None = None

    def fault(self, message: str) -> Fault:
        if self.file is None:
            return Fault(self.text, message)
        return Fault(self.file, f"{self.text}: {message}", line=self.line)


def find_logs(arguments: Sequence[str]) -> list[str]:
    """Paths and URLs of the logs that arguments stand for, in their order, each once.

    Parameters
    ----------
    arguments : each a file; a folder (its MCAP files and those below); a glob pattern such as ``runs/**/*.mcap``; a URL
        of a file, and where the server lists files of a folder or with a glob; or ``@FILE`` (``@-``: standard input),
        a text file with one of these in each line. A name that exists is no pattern.

    Returns
    -------
    sources : folders and patterns in natural order. A file that is not there is kept, unless it is the only one: it
        fails when it is read, by itself. So is a folder that cannot be entered.

    Raises
    ------
    InputFileError
        With the faults of all arguments that stand for nothing.
    UsageError
        If a package is missing that a URL needs.
    """
    entries = [entry for text in arguments for entry in _entries(text)]
    sources: list[str] = []
    faults: list[Fault] = []
    for entry in entries:
        try:
            sources += _found(entry, only=len(entries) == 1)
        except InputFileError as error:
            faults += [entry.fault(fault.message) for fault in error.faults]
    if faults:
        raise InputFileError(faults)
    return once(sources, identity=lambda source: source if is_url(source) else os.path.realpath(source))


def _found(entry: _Entry, only: bool) -> list[str]:
    path = entry.text
    if not path:
        raise InputFileError(entry.fault("found an empty argument, expected a log; check the variables of the script"))
    # An existing name is meant as it is, whatever signs are in it.
    if not os.path.lexists(path) and is_url(path):
        if (local := local_path(path)) is None:
            return find_urls(path)
        path = local
    if not os.path.lexists(path):
        path = _at_home(path)
    if is_folder(Path(path)):
        if not (logs := search_folder(Path(path))):
            advice = "name other logs by a pattern in quotes, such as 'runs/*.csv'"
            raise InputFileError(entry.fault(f"found no log (*.mcap) in this folder or below; {advice}"))
        return logs
    if has_magic(path) and not os.path.lexists(path):
        if not (logs := search_glob(path)):
            raise InputFileError(entry.fault("found nothing that matches; check the pattern and the folder"))
        return logs
    if only and (fault := _unusable(Path(path))) is not None:
        raise InputFileError(entry.fault(fault))
    return [path]


def _entries(text: str) -> Iterator[_Entry]:
    """The argument itself, or the lines of the list that it names."""
    if not text.startswith("@") or text == "@":
        yield _Entry(text)
        return
    name = text[1:]
    found = False
    for number, line in enumerate(_lines(name), start=1):
        if (wanted := line.strip()) and not wanted.startswith("#"):
            if wanted.startswith("@"):
                message = f"found {wanted}, expected a log, folder, pattern or URL; put the lines of that list here"
                raise InputFileError(Fault(name, message, line=number))
            found = True
            yield _Entry(wanted, name, number)
    if not found:
        raise InputFileError(Fault(name, "found no log in this list; write one path, folder, pattern or URL per line"))


def _lines(name: str) -> list[str]:
    """Lines of a list; bytes that are no UTF-8 stay what they are in names of files."""
    try:
        raw = sys.stdin.buffer.read() if name == "-" else Path(_at_home(name)).read_bytes()
    except OSError as error:
        raise InputFileError(Fault(name, f"list of logs cannot be read: {error.strerror}; check the path")) from error
    if b"\0" in raw:
        raise InputFileError(Fault(name, "found no text, expected a list of logs; leave out the @ to read a log"))
    return os.fsdecode(raw.removeprefix(b"\xef\xbb\xbf")).split("\n")


def _at_home(path: str) -> str:
    """The path with ~ written out."""
    try:
        return str(Path(path).expanduser()) if path.startswith("~") else path
    except RuntimeError:  # nobody of that name
        return path


@contextmanager
def local_copy(source: str) -> Iterator[Path]:
    """A local file with a log: itself, or fetched from its URL and removed afterwards.

    Errors that are raised inside the block about a fetched file are reported of the URL.

    Raises
    ------
    InputFileError
        If there is no such file, or it cannot be fetched.
    UsageError
        If a package is missing that a URL needs.
    """
    if not os.path.lexists(source) and is_url(source) and local_path(source) is None:
        with fetched(source) as path:
            try:
                yield path
            except InputFileError as error:
                faults = (replace(f, file=source) if f.file == str(path) else f for f in error.faults)
                raise InputFileError(faults) from error
        return
    path = Path(source if os.path.lexists(source) else local_path(source) or source)
    if (fault := _unusable(path)) is not None:
        raise InputFileError(Fault(source, fault))
    yield path


def _unusable(path: Path) -> str | None:
    """Why a path is no log, in words; None if it is a file."""
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            next(path.iterdir(), None)
            return "found a folder, expected a log; name the file inside it"
    except FileNotFoundError:
        return "found a link to a file that is not there" if path.is_symlink() else "file not found; check the path"
    except OSError as error:
        missing = "; logs in this folder and below are missing" if is_folder(path) else ""
        return f"cannot be read: {error.strerror}{missing}"
    return None if stat.S_ISREG(mode) else "is not a regular file; check the path"


def job_names(sources: Sequence[str], taken: Iterable[str] = ()) -> list[str]:
    """Names of logs for people and outputs: the file's, without its ending; of the same ones the next get -2, -3, ...

    Parameters
    ----------
    taken : names that no log may have

    Returns
    -------
    names : all different, also where the file system does not tell a from A; none too long for a file system
    """
    used = {_folded(name) for name in taken}
    counts: dict[str, int] = {}
    names = []
    for source in sources:
        stem = name = _stem(source)
        folded = _folded(stem)
        count = counts.get(folded, 1)
        while _folded(name) in used:
            count += 1
            name = f"{stem}-{count}"
        counts[folded] = count
        used.add(_folded(name))
        names.append(name)
    return names


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


def source_name(source: str) -> str:
    """File name of a log; of a web address without its query, which may hold a signature."""
    return url_name(source) if is_url(source) and not os.path.lexists(source) else Path(source).name


def source_label(source: str) -> str:
    """A log's path; of a URL without user and query, which may hold keys."""
    if not is_url(source) or os.path.lexists(source):
        return source
    parts = urlsplit(source)
    return urlunsplit((parts.scheme, parts.netloc.rpartition("@")[2], parts.path, "", ""))


def _stem(source: str) -> str:
    stem = Path(source_name(source)).stem
    while len(os.fsencode(stem)) > _LONGEST_NAME:
        stem = stem[:-1]
    return "log" if stem in ("", ".", "..") else stem
