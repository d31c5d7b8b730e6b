"""Folders that a run makes and leaves tidy."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from modrob_cli.errors import OutputError


@contextmanager
def made_folder(folder: Path) -> Iterator[Path]:
    """A folder that is there in the block; folders that were made for it go again if they are empty at its end.

    Raises
    ------
    OutputError
        If it cannot be made.
    """
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the output folder {folder}: {error.strerror}") from error
    try:
        yield folder
    finally:
        for path in missing:
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()


@contextmanager
def staging_folder(folder: Path) -> Iterator[Path]:
    """An empty folder for temporary files; what a run that was killed left in it is removed, and everything at the end.

    Raises
    ------
    OutputError
        If it cannot be made.
    """
    shutil.rmtree(folder, ignore_errors=True)
    try:
        folder.mkdir()
    except OSError as error:
        raise OutputError(f"cannot write into {folder.parent}: {error.strerror}") from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
