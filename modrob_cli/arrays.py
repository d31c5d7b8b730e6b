"""The array type that all rooms share, and read-only copies of it."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from modrob_cli.errors import ShapeError

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def frozen(value: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Copy ``value`` into a read-only array of doubles.

    Parameters
    ----------
    value : array_like
    shape : expected shape; -1 stands for any length

    Raises
    ------
    ShapeError
        If the shape differs.
    """
    out = np.array(value, dtype=float)
    if out.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, out.shape, strict=True)):
        raise ShapeError(f"expected an array of shape {shape}, got {out.shape}")
    out.setflags(write=False)
    return out
