"""Logs behind URLs, by fsspec: found in folders and by globs, fetched to temporary files."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import unquote

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.log_search import LOG_SUFFIX, has_magic, natural_key, wanted_in_folder

_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")
_CHAIN = re.compile(r"::(?=[A-Za-z][A-Za-z0-9+.-]*://)")
"""Between the URLs of a chain, as in ``zip://run.mcap::s3://bucket/runs.zip``."""
_BLOCK = 4 << 20
"""Bytes that are fetched at a time."""
_NAME_LENGTH = 200


def is_url(text: str) -> bool:
    """Whether a source is a URL; ``file://`` is one too."""
    return _URL.match(text) is not None


def local_path(url: str) -> str | None:
    """Path of a ``file://`` URL; None for any other."""
    return re.sub("^file://(localhost(?=/))?", "", url) if url.startswith("file://") else None


def url_name(url: str) -> str:
    """File name that a URL ends with, safe to be one here; "log" if there is none."""
    path = _path(_CHAIN.split(url)[0])
    if _is_web(url):
        path = unquote(path)
    name = path.rstrip("/").rpartition("/")[2]
    name = "".join(sign if sign.isprintable() else "_" for sign in name)
    return "log" if name in ("", ".", "..") else name[-_NAME_LENGTH:]


def find_urls(url: str) -> list[str]:
    """The log behind a URL; or those that its glob matches, or that are in its folder and below, in natural order.

    Only globs and folders ask the server. A web address is a folder if it ends with a slash, and a question mark in it
    begins a query.

    Raises
    ------
    UsageError
        If fsspec or what it needs for this kind of URL is not installed.
    InputFileError
        If the server cannot be asked, or there is nothing.
    """
    system = _file_system_class(url)
    path = _path(url)
    is_log = path.lower().endswith((LOG_SUFFIX, ".csv"))
    if _CHAIN.search(url) or (not has_magic(path) and (is_log or (_is_web(url) and not path.endswith("/")))):
        return [url]
    try:
        found = _search(url, has_magic(path))
    except Exception as error:  # of any library behind fsspec
        raise _fault(url, f"cannot be listed: {_words(error)}") from error
    if not found:
        what = "that matches" if has_magic(path) else f"that ends with {LOG_SUFFIX} in it or below"
        raise _fault(url, f"found nothing {what}; check the URL, and whether {system.__name__} can list it")
    return sorted(found, key=natural_key)


def _search(url: str, magic: bool) -> list[str]:
    from fsspec.core import url_to_fs

    files, path = url_to_fs(url)
    if magic:
        if files.exists(path):
            return [url]
        matches = files.glob(path, detail=True)
        folders = [name for name, about in matches.items() if about["type"] == "directory"]
        found = [name for name, about in matches.items() if about["type"] != "directory"]
    elif files.isdir(path):
        folders, found = [path], []
    else:
        return [url]
    for folder in folders:
        found += [name for name in files.find(folder) if _wanted(name[len(folder) :])]
    return list(dict.fromkeys(files.unstrip_protocol(name) for name in found))


def _wanted(below: str) -> bool:
    *folders, name = below.strip("/").split("/")
    return wanted_in_folder(name) and not any(folder.startswith(".") for folder in folders)


@contextmanager
def fetched(url: str) -> Iterator[Path]:
    """A temporary file with the content of a URL, removed afterwards.

    Raises
    ------
    UsageError
        If fsspec or what it needs for this kind of URL is not installed.
    InputFileError
        If it cannot be fetched whole, or does not fit into the folder for temporary files.
    """
    _file_system_class(url)
    with TemporaryDirectory(prefix="modrob-") as folder:
        path = Path(folder) / url_name(url)
        try:
            _fetch(url, path)
        except InputFileError:
            raise
        except Exception as error:  # of any library behind fsspec
            raise _fault(url, f"cannot be fetched: {_words(error)}") from error
        yield path


def _fetch(url: str, path: Path) -> None:
    from fsspec.core import url_to_fs

    files, name = url_to_fs(url)
    with files.open(name, "rb") as remote:
        size = getattr(remote, "size", None)
        got = 0
        while block := remote.read(_BLOCK):
            _keep(path, block, url)
            got += len(block)
        path.touch()
    if isinstance(size, int) and got != size:
        raise _fault(url, f"was fetched in part only: {got} of {size} bytes; try again")


def _keep(path: Path, block: bytes, url: str) -> None:
    try:
        with path.open("ab") as stream:
            stream.write(block)
    except OSError as error:
        advice = "set TMPDIR to a folder with more space"
        raise _fault(
            url, f"cannot be kept in {path.parent.parent} while it is read: {error.strerror}; {advice}"
        ) from error


def _file_system_class(url: str) -> Any:
    match = _URL.match(url)
    protocol = match[1].lower() if match else ""
    try:
        from fsspec import get_filesystem_class
    except ImportError as error:
        raise UsageError(f"{url}: URLs need fsspec: pip install 'modrob[dask]'") from error
    try:
        return get_filesystem_class(protocol)
    except ImportError as error:
        raise UsageError(f"{url}: {protocol}:// needs another package: {error}") from error
    except ValueError as error:
        raise UsageError(f"{url}: found {protocol}://, which fsspec does not know; check the URL") from error


def _path(url: str) -> str:
    """A URL without its kind; a web address also without host and query."""
    path = _URL.sub("", url, count=1)
    return "/" + re.split("[?#]", path, maxsplit=1)[0].partition("/")[2] if _is_web(url) else path


def _is_web(url: str) -> bool:
    return url.lower().startswith(("http://", "https://"))


def _words(error: Exception) -> str:
    """What went wrong, in one piece; libraries have errors without words."""
    text = " ".join((error.strerror if isinstance(error, OSError) and error.strerror else str(error)).split())
    if isinstance(error, FileNotFoundError):
        return "there is no such file; check the URL"
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _fault(url: str, message: str) -> InputFileError:
    return InputFileError(Fault(url, message))
