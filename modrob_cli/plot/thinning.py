"""Curves with more samples than a picture has pixels."""

import numpy as np

from modrob_cli.arrays import Array

MAX_POINTS = 6000


def thin(t: Array, x: Array, most: int = MAX_POINTS) -> tuple[Array, Array]:
    """Keep the smallest and the largest of each run of samples, so that no peak is lost.

    Parameters
    ----------
    t, x : shape (N,)

    Returns
    -------
    t, x : at most about ``most`` of them
    """
    size = -(-len(x) // (most // 2))
    if size <= 2:
        return t, x
    whole = len(x) // size * size
    runs = x[:whole].reshape(-1, size)
    offsets = np.arange(len(runs)) * size
    picks = np.concatenate([offsets + runs.argmin(axis=1), offsets + runs.argmax(axis=1), [len(x) - 1]])
    picks = np.unique(picks)
    return t[picks], x[picks]
