"""Samples of a log in temporary files, for logs that are too long for memory."""

import os
import tempfile
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.errors import OutputError
from modrob_cli.io.cdr_layout import Stamps

Rows = NDArray[np.void]
"""Samples: ``time`` [ns] and ``values``, positions, velocities and efforts, shape (3, n)."""


def row_type(n: int) -> np.dtype[np.void]:
    """Type of a sample of n joints."""
    return np.dtype([("time", "<i8"), ("values", "<f8", (3, n))])


class SampleStore:
    """Two files without names, which are gone when they are closed or the program ends, however it ends.

    Attributes
    ----------
    count : samples in it
    """

    def __init__(self, n: int) -> None:
        self.n = n
        self.count = 0
        self._files: list[BinaryIO] = []

    def append(self, rows: Rows) -> None:
        """Put samples at the end.

        Raises
        ------
        OutputError
            If there is no room for them.
        """
        try:
            while len(self._files) < 2:
                self._files.append(tempfile.TemporaryFile(prefix="modrob-", buffering=0))  # noqa: SIM115 (see close)
            for file, key in zip(self._files, ("time", "values"), strict=True):
                raw = np.ascontiguousarray(rows[key]).reshape(-1).view(np.uint8).data
                while raw:
                    raw = raw[file.write(raw) :]
        except OSError as error:
            self.close()
            raise OutputError(
                f"cannot write samples of a long log into {tempfile.gettempdir()}: {error.strerror or error}; set "
                "TMPDIR to a folder with more room"
            ) from error
        self.count += len(rows)

    def times(self, first: int, last: int) -> Stamps:
        """Times of the samples first .. last - 1, all of which are there, shape (N,), [ns]."""
        return np.asarray(self._read(0, first, np.empty(last - first, dtype="<i8")))

    def values(self, first: int, last: int) -> Array:
        """Their positions, velocities and efforts, shape (N, 3, n)."""
        return np.asarray(self._read(1, first, np.empty((last - first, 3, self.n), dtype="<f8")))

    def _read(self, file: int, first: int, out: NDArray[Any]) -> NDArray[Any]:
        raw = out.reshape(-1).view(np.uint8).data
        place = first * out.strides[0]
        while raw:
            done = os.preadv(self._files[file].fileno(), [raw], place)
            if not done:
                raise ValueError("samples beyond the end of a store")
            raw, place = raw[done:], place + done
        return out

    def close(self) -> None:
        """Give up the samples."""
        while self._files:
            self._files.pop().close()
        self.count = 0
