"""Motions of single joints with exact derivatives: pieces of polynomial plus cosine, and sums of sines."""

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from modrob_cli.arrays import Array, frozen
from modrob_cli.errors import ShapeError

MOST_DERIVED = 4
"""Derivatives are known up to this order."""
DIVISIONS = 32
"""Parts of a period, or of a piece of polynomial, that are looked at one by one in search of extremes."""
FEWEST_DIVISIONS, MOST_PARTS = 4, 2**15
"""Of a curve of very many pieces (samples) each one is short and is divided less, into 4 parts at least."""


class Curve(Protocol):
    """Motion of one joint over 0 .. duration."""

    @property
    def knots(self) -> Array:
        """Times 0 .. duration, shape (m + 1,), [s]; the curve is smooth between neighbours."""

    @property
    def divisions(self) -> int:
        """Into how many parts the time between two knots is to be divided to see each turn of the curve."""

    def derivative(self, t: Array, order: int, before: bool = False) -> Array:
        """Derivative of the given order, 0 to 4, at times t within the knots; shape of t, [rad/s^order].

        Parameters
        ----------
        before : at a knot take the limit from the left, else from the right (at the last knot always from the left)
        """


@dataclass(frozen=True)
class PiecewiseCurve:
    """Pieces c_0 + c_1 s + ... + c_p s^p + b (1 - cos(2 pi s)), where s = 0 .. 1 is the time within the piece.

    Attributes
    ----------
    knots : times where pieces begin and end, increasing from 0, shape (m + 1,), [s]
    coefficients : c, shape (m, p + 1), [rad] or [m]
    ripple : b of each piece, shape (m,), [rad] or [m]
    """

    knots: Array
    coefficients: Array
    ripple: Array

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit together.

        Raises
        ------
        ShapeError
            If they do not, or the knots do not increase from 0.
        """
        object.__setattr__(self, "knots", frozen(self.knots, (-1,)))
        pieces = len(self.knots) - 1
        object.__setattr__(self, "coefficients", frozen(self.coefficients, (pieces, -1)))
        object.__setattr__(self, "ripple", frozen(self.ripple, (pieces,)))
        if pieces < 1 or self.knots[0] != 0.0 or not (np.diff(self.knots) > 0.0).all():
            raise ShapeError("expected at least two knots that increase from 0")

    @property
    def divisions(self) -> int:
        """Parts of a piece: it has at most one period of the cosine, or a few turns of the polynomial."""
        return int(np.clip(MOST_PARTS // len(self.ripple), FEWEST_DIVISIONS, DIVISIONS))

    def derivative(self, t: Array, order: int, before: bool = False) -> Array:
        """Derivative of the given order at times t, as :class:`Curve` says."""
        side: Literal["left", "right"] = "left" if before else "right"
        piece = np.clip(np.searchsorted(self.knots, t, side) - 1, 0, len(self.knots) - 2)
        length = np.diff(self.knots)[piece]
        s = (t - self.knots[piece]) / length
        falling = [math.perm(k, order) for k in range(self.coefficients.shape[1])]
        derived = (self.coefficients * falling)[:, order:]
        out = np.zeros_like(s)
        for k in range(derived.shape[1] - 1, -1, -1):  # Horner
            out = out * s + derived[piece, k]
        if not self.ripple.any():
            return np.asarray(out / length**order)
        w = 2.0 * math.pi
        wave = (np.cos(w * s), -np.sin(w * s))[order % 2] * (1.0, 1.0, -1.0, -1.0)[order % 4] * w**order
        out = out + self.ripple[piece] * ((1.0 if order == 0 else 0.0) - wave)
        return np.asarray(out / length**order)


@dataclass(frozen=True)
class SineCurve:
    """A sum offset + sum_k a_k sin(w_k t + phi_k) over 0 .. duration.

    Attributes
    ----------
    duration : [s];  offset : [rad] or [m]
    amplitude : a, shape (K,), [rad] or [m];  frequency : w, shape (K,), [rad/s];  phase : phi, shape (K,), [rad]
    """

    duration: float
    offset: float
    amplitude: Array
    frequency: Array
    phase: Array

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit together.

        Raises
        ------
        ShapeError
            If they do not, or the duration is not positive.
        """
        object.__setattr__(self, "amplitude", frozen(self.amplitude, (-1,)))
        for key in ("frequency", "phase"):
            object.__setattr__(self, key, frozen(getattr(self, key), self.amplitude.shape))
        if not self.duration > 0.0:
            raise ShapeError(f"expected a duration > 0, got {self.duration}")

    @property
    def knots(self) -> Array:
        """Begin and end: the sum is smooth."""
        return frozen([0.0, self.duration], (2,))

    @property
    def periods(self) -> float:
        """Number of periods of the fastest term."""
        return float(self.duration * np.abs(self.frequency).max(initial=0.0) / (2.0 * math.pi))

    @property
    def divisions(self) -> int:
        """Parts of the duration: as many in each period of the fastest term as in a piece of polynomial."""
        return max(DIVISIONS, math.ceil(DIVISIONS * self.periods))

    def derivative(self, t: Array, order: int, before: bool = False) -> Array:
        """Derivative of the given order at times t, as :class:`Curve` says."""
        angle = t[..., None] * self.frequency + self.phase
        wave = (np.sin(angle), np.cos(angle))[order % 2] * (1.0, 1.0, -1.0, -1.0)[order % 4]
        value = (wave * (self.amplitude * self.frequency**order)).sum(axis=-1)
        return np.asarray(value + self.offset if order == 0 else value)


def sine_product(duration: float, offset: float, amplitude: float, frequency: Array, phase: Array) -> SineCurve:
    """Curve offset + a prod_k sin(w_k t + phi_k), as the sum of sines that it is. [R] eq. (13), [D] eq. (3.44).

    Each factor doubles the terms: sin x sin y = (sin(x - y + pi/2) - sin(x + y + pi/2)) / 2.

    Parameters
    ----------
    frequency, phase : w [rad/s] and phi [rad] of the factors, shape (K,), K >= 1
    """
    size, w, phi = np.array([amplitude]), frequency[:1], phase[:1]
    for more, shift in zip(frequency[1:], phase[1:], strict=True):
        size = np.concatenate([0.5 * size, -0.5 * size])
        w, phi = np.concatenate([w - more, w + more]), np.concatenate([phi - shift, phi + shift]) + 0.5 * math.pi
    return SineCurve(duration, offset, size, w, phi)
