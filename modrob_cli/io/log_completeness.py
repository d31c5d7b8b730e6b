"""Which samples of a log are complete: they have a position and an effort of every joint."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError

Mask = NDArray[np.bool_]


class Completeness:
    """Counts over the samples of a log, piece by piece; n joints.

    Attributes
    ----------
    samples, complete : all samples, and those with all positions and efforts
    unknown_velocities : complete samples that lack a velocity
    velocities : whether any sample has one
    """

    def __init__(self, n: int) -> None:
        self.samples = self.complete = self.unknown_velocities = 0
        self.velocities = False
        self._efforts = False
        self._seen = {"position": np.zeros(n, dtype=bool), "effort": np.zeros(n, dtype=bool)}

    def add(self, q: Array, dq: Array | None, effort: Array | None) -> Mask:
        """Count samples (N, n); returns which are complete, shape (N,)."""
        good = np.isfinite(q).all(axis=1)
        self._seen["position"] |= np.isfinite(q).any(axis=0)
        if effort is None:
            good = np.zeros(len(q), dtype=bool)
        else:
            good &= np.isfinite(effort).all(axis=1)
            self._seen["effort"] |= np.isfinite(effort).any(axis=0)
            self._efforts |= not np.isnan(effort).all()
        self.samples += len(q)
        self.complete += int(np.count_nonzero(good))
        if dq is not None:
            self.velocities |= not np.isnan(dq).all()
            self.unknown_velocities += int(np.count_nonzero(good & ~np.isfinite(dq).all(axis=1)))
        return np.asarray(good)

    def notes(self, path: Path, names: Sequence[str]) -> list[str]:
        """What is missing, for people.

        Raises
        ------
        InputFileError
            If a joint has no position or effort at all, or fewer than two samples are complete.
        """
        if not self._efforts:
            raise _fault(path, f"found no effort of {', '.join(names)}; a log needs effort")
        for what, seen in self._seen.items():
            if not seen.all():
                empty = ", ".join(name for name, found in zip(names, seen, strict=True) if not found)
                raise _fault(path, f"found no {what} of {empty}; a log needs positions and efforts of all joints")
        if self.complete < 2:
            raise _fault(path, f"found {self.complete} samples with all positions and efforts, expected 2 or more")
        out = []
        if self.complete < self.samples:
            left = self.samples - self.complete
            out.append(f"{left} of {self.samples} samples lack a position or an effort and were left out")
        if self.velocities and self.unknown_velocities:
            missing = f"{self.unknown_velocities} of {self.complete}"
            out.append(f"velocities are missing in {missing} samples and count as not recorded")
        return out

    @property
    def has_velocity(self) -> bool:
        """Whether all complete samples have all velocities."""
        return self.velocities and not self.unknown_velocities


def _fault(path: Path, message: str) -> InputFileError:
    return InputFileError(Fault(str(path), message))
