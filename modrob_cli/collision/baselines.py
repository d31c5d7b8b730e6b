"""What is usually done instead of bands: constant thresholds, learned from a run without contact."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.collision.observer import MomentumTerms, ObserverRun

GAINS = (2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
"""Gains of the observer that are tried [1/s]."""
ANSWER = 0.1
"""Time in which the observer is to answer [s]: the gain is tuned for the smallest torque step that is found by then."""


def constant_thresholds(residuals: list[Array], margin: float) -> Array:
    """Threshold of abs(residual) for each joint, shape (n,): the largest of the training runs plus a margin.

    Parameters
    ----------
    residuals : shape (N, n) for each run;  margin : part of the largest that is added, such as 0.2
    """
    return np.asarray((1.0 + margin) * np.max([np.abs(residual).max(axis=0) for residual in residuals], axis=0))


def beyond(residual: Array, thresholds: Array) -> Array:
    """Signed distance of a residual (N, n) from +-threshold (n,); 0 inside."""
    return np.asarray(np.sign(residual) * np.maximum(np.abs(residual) - thresholds, 0.0))


@dataclass(frozen=True)
class TunedObserver:
    """A gain [1/s] and thresholds of the external torque, shape (n,)."""

    gain: float
    thresholds: Array


class ObserverTuner:
    """Chooses the gain on runs without contact, which come piece by piece.

    A high gain answers fast and lets the noise through. Of :data:`GAINS` the one is taken that finds the smallest
    step of torque within :data:`ANSWER`, the mean over the joints relative to the smallest of each.
    """

    def __init__(self) -> None:
        self._most = np.zeros(1)
        self.begin()

    def begin(self) -> None:
        """Begin a new run."""
        self._run = ObserverRun(np.array(GAINS)[:, None])

    def add(self, terms: MomentumTerms) -> None:
        """Take the next samples of the run."""
        self._most = np.maximum(self._most, np.abs(self._run.add(terms)).max(axis=0))

    def tuned(self, margin: float) -> TunedObserver:
        """Gain and thresholds by all runs up to now; ``margin`` as for :func:`constant_thresholds`."""
        found = (1.0 + margin) * self._most
        steps = found / (1.0 - np.exp(-np.array(GAINS) * ANSWER))[:, None]
        least = np.where(steps.min(axis=0) > 0.0, steps.min(axis=0), 1.0)
        best = int((steps / least).mean(axis=1).argmin())
        return TunedObserver(GAINS[best], found[best])


def tune_observer(runs: list[MomentumTerms], margin: float) -> TunedObserver:
    """Choose the gain on whole runs; see :class:`ObserverTuner`."""
    tuner = ObserverTuner()
    for run in runs:
        tuner.begin()
        tuner.add(run)
    return tuner.tuned(margin)
