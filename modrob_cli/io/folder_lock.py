"""One run at a time in a folder."""

import fcntl
import os
import socket
from pathlib import Path
from types import TracebackType
from typing import Self

from modrob_cli.errors import OutputError, UsageError

_LONGEST = 300


class FolderLock:
    """A lock that the system gives back when its process ends, however it ends.

    Raises
    ------
    UsageError
        If another process holds it, saying which.
    OutputError
        If the lock file cannot be written.
    """

    def __init__(self, path: Path, holder: str) -> None:
        self.path = path
        self.holder = f"{holder}, process {os.getpid()} on {socket.gethostname()}"
        self._handle = -1

    def __enter__(self) -> Self:
        """Take the lock, or say who has it."""
        while True:
            try:
                handle = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o666)
            except OSError as error:
                raise OutputError(f"cannot write into {self.path.parent}: {error.strerror}") from error
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                other = os.read(handle, _LONGEST).decode(errors="replace").strip()
                os.close(handle)
                raise UsageError(
                    f"{self.path.parent} is in use by another run ({other or 'which is just starting'}); wait until it "
                    "has ended, or choose another folder with --out"
                ) from None
            except OSError as error:  # a file system without locks
                os.close(handle)
                message = (
                    f"cannot lock {self.path}: {error.strerror}; choose a folder on another file system with --out"
                )
                raise OutputError(message) from error
            if self._is_current(handle):
                break
            os.close(handle)  # the run before removed it between our two steps
        self._handle = handle
        try:
            os.ftruncate(handle, 0)
            os.write(handle, self.holder.encode())
        except OSError as error:
            self._release()
            raise OutputError(f"cannot write into {self.path.parent}: {error.strerror}") from error
        return self

    def _is_current(self, handle: int) -> bool:
        try:
            return os.fstat(handle).st_ino == self.path.stat().st_ino
        except FileNotFoundError:
            return False

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the lock back and remove its file."""
        self._release()

    def _release(self) -> None:
        # Removed while it is held: whoever waits for it then sees that it is another file.
        self.path.unlink(missing_ok=True)
        os.close(self._handle)
