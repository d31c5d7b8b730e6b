"""Outputs that are written whole or not at all."""

import hashlib
import os
import tempfile
from collections import Counter
from pathlib import Path
from types import TracebackType
from typing import Self

from modrob_cli import __version__
from modrob_cli.errors import OutputError, OutputExistsError, UsageError


def sha256(path: Path) -> str:
    """Hex digest of a file's content."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def text_sha256(text: str) -> str:
    """Hex digest of a text as it is written, with the name of the algorithm."""
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def provenance(inputs: list[Path]) -> dict[str, object]:
    """What an output was made from: the tool's version and the hash of each input file.

    Inputs go by file name, or by the path as given where two share a name.
    """
    paths = sorted(set(inputs))
    names = Counter(path.name for path in paths)
    hashes = {path.name if names[path.name] == 1 else str(path): f"sha256:{sha256(path)}" for path in paths}
    return {"modrob": __version__, "inputs": hashes}


def read_files(folder: Path, names: list[str]) -> dict[str, bytes]:
    """Content of some files of a folder by name, in this order."""
    return {name: (folder / name).read_bytes() for name in names}


class OutputFolder:
    """Collects files and puts them into a folder together when the ``with`` block ends well.

    Files are written beside their place under temporary names, then renamed; after an error inside the block
    nothing is left, not even a folder that was made for them.

    Raises
    ------
    OutputExistsError
        If a file is there already and ``overwrite`` is false; before anything is written.
    OutputError
        If the folder cannot be made or written.
    UsageError
        If two files get one name.

    Parameters
    ----------
    temporary : folder for the temporary files, on the same disk; None for the folders that they go to
    """

    def __init__(self, folder: Path, overwrite: bool = False, temporary: Path | None = None) -> None:
        self.folder = folder
        self.overwrite = overwrite
        self.temporary = temporary
        self._staged: dict[Path, Path] = {}
        self._made: list[Path] = []

    def __enter__(self) -> Self:
        """Make the folder."""
        try:
            missing = [path for path in (self.folder, *self.folder.parents) if not path.exists()]
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot make the output folder {self.folder}: {error.strerror}") from error
        self._made = missing
        return self

    def claim(self, names: list[str]) -> None:
        """Check before the work that these files may be written.

        Raises
        ------
        OutputExistsError
            Listing those that exist, unless overwriting is allowed.
        UsageError
            If a folder is in the place of one.
        """
        folders = [str(self.folder / name) for name in names if (self.folder / name).is_dir()]
        if folders:
            raise UsageError(
                f"{', '.join(folders)}: found a folder where a file is to be written; choose another folder"
            )
        there = [str(self.folder / name) for name in names if (self.folder / name).exists()]
        if there and not self.overwrite:
            raise OutputExistsError(f"{', '.join(there)}: exists already; pass --overwrite to replace it")

    def stage(self, name: str) -> Path:
        """Temporary path for a file; the caller writes it, the end of the block renames it.

        The name may lie in a folder of its own, as in ``parts/one.yaml``; the folder is made.
        """
        self.claim([name])
        target = self.folder / name
        if target in self._staged:
            raise UsageError(f"two outputs of one name: {target}; choose another name or folder")
        try:
            if not target.parent.exists():
                target.parent.mkdir()
                self._made.insert(0, target.parent)
            handle, path = tempfile.mkstemp(
                prefix=".modrob-", suffix=target.suffix, dir=self.temporary or target.parent
            )
        except OSError as error:
            raise OutputError(f"cannot write into {self.folder}: {error.strerror}") from error
        os.close(handle)
        self._staged[target] = Path(path)
        return Path(path)

    def hashes(self) -> dict[str, str]:
        """Hash of each file that was staged so far, by name."""
        named = {str(target.relative_to(self.folder)): path for target, path in self._staged.items()}
        return {name: f"sha256:{sha256(path)}" for name, path in named.items()}

    def write(self, name: str, content: str | bytes) -> Path:
        """Stage a file with this content; returns its final path."""
        raw = content.encode() if isinstance(content, str) else content
        self.stage(name).write_bytes(raw)
        return self.folder / name

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Rename all files into place, or remove all of them; a failure to write becomes an OutputError."""
        if kind is None:
            try:
                self._rename()
            except OSError as problem:
                self._discard()
                raise OutputError(f"cannot write into {self.folder}: {problem.strerror or problem}") from problem
            return
        self._discard()
        if isinstance(error, OSError):
            raise OutputError(f"cannot write into {self.folder}: {error.strerror or error}") from error

    def _rename(self) -> None:
        """Put the staged files into place, with the permissions of any new file."""
        umask = os.umask(0)
        os.umask(umask)
        for path in self._staged.values():
            path.chmod(0o666 & ~umask)
        for target, path in self._staged.items():
            path.replace(target)

    def _discard(self) -> None:
        """Remove what is staged, and folders that were made for it."""
        for path in self._staged.values():
            path.unlink(missing_ok=True)
        for folder in self._made:
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()
