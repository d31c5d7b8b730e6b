r"""What one joint's samples ask of its friction, rotor and disturbance, and the band that given intervals make.

With the rigid bodies' torque known to lie in [low, high] at each sample, a recorded torque tau lies inside the torque
bounds of the arm exactly if

.. math:: \overline f(x) \ge \tau - high \quad\text{and}\quad \underline f(x) \le \tau - low,

where f is the band of friction, rotor and disturbance of :mod:`modrob_cli.dynamics.drive_torque`. Its edges are linear
in the ends of the intervals, x = (viscous, Coulomb, armature, disturbance), a lower and an upper end each, because
which end decides depends on the signs of dq and ddq alone. That makes the search for the smallest intervals a linear
programme.
"""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array, Indices

PARAMETERS = ("viscous", "coulomb", "armature", "disturbance")
"""Order of the intervals in x; parameter k has its lower end at 2 k and its upper end at 2 k + 1."""

ENDS = 2 * len(PARAMETERS)
VISCOUS, COULOMB, ARMATURE, DISTURBANCE = range(4)

Mask = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class JointSamples:
    """Contact-free samples of one joint, N of them; all torques [N m] or [N].

    Attributes
    ----------
    dq, ddq : velocity and acceleration, shape (N,), [rad/s] or [m/s] and derivative
    tau : recorded joint torque, shape (N,)
    low, high : range of the rigid bodies' torque at the sample, shape (N,)
    velocity_band : up to this speed the sign of the friction is unknown, >= 0
    dq_noise, ddq_noise : dq and ddq are known to +- this, >= 0
    """

    dq: Array
    ddq: Array
    tau: Array
    low: Array
    high: Array
    velocity_band: float
    dq_noise: float = 0.0
    ddq_noise: float = 0.0

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.tau)

    def picked(self, chosen: Mask | Indices) -> Self:
        """Some of the samples."""
        arrays: dict[str, Any] = {
            key: value[chosen] for key, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        return replace(self, **arrays)

    @property
    def scale(self) -> float:
        """Size of the torques, for tolerances; at least 1e-9, which is nothing for an arm."""
        reach = [np.max(np.abs(x), initial=0.0) for x in (self.tau - self.low, self.tau - self.high)]
        return float(max(*reach, 1e-9))

    def reach(self) -> Array:
        """Largest effect of a unit of each end, shape (8,); 1 where it has none."""
        rates = [np.max(np.abs(rate), initial=0.0) for rate in (self.dq, self.ddq)]
        effect = np.repeat([rates[0] + self.dq_noise, 1.0, rates[1] + self.ddq_noise, 1.0], 2)
        return np.where(effect > 0.0, effect, 1.0)

    def least_upper(self) -> Array:
        """What the band's upper edge has to reach, tau - high, shape (N,)."""
        return self.tau - self.high

    def most_lower(self) -> Array:
        """What the band's lower edge must not exceed, tau - low, shape (N,)."""
        return self.tau - self.low

    def edges(self, ends: Array) -> tuple[Array, Array]:
        """Lower and upper edge (N,) of the band that intervals with these ends (8,) make; rounded to nearest."""
        lower, upper = np.full(len(self), ends[6]), np.full(len(self), ends[7])
        down, up = self._may_go()
        upper += np.where(up, ends[3], -ends[2])
        lower += np.where(down, -ends[3], ends[2])
        for at, rate, noise in ((0, self.dq, self.dq_noise), (4, self.ddq, self.ddq_noise)):
            if ends[at + 1] > 0.0:
                least, most = rate - noise, rate + noise
                upper += np.where(most > 0.0, ends[at + 1], ends[at]) * most
                lower += np.where(least < 0.0, ends[at + 1], ends[at]) * least
        return lower, upper

    def rows(self, at: Indices) -> tuple[Array, Array]:
        """The same as rows: edges = rows @ ends for samples ``at``; two arrays of shape (len(at), 8)."""
        part = self.picked(at)
        index = np.arange(len(part))
        lower, upper = np.zeros((len(part), ENDS)), np.zeros((len(part), ENDS))
        down, up = part._may_go()
        upper[index, np.where(up, 3, 2)] = np.where(up, 1.0, -1.0)
        lower[index, np.where(down, 3, 2)] = np.where(down, -1.0, 1.0)
        for start, rate, noise in ((0, part.dq, part.dq_noise), (4, part.ddq, part.ddq_noise)):
            least, most = rate - noise, rate + noise
            upper[index, np.where(most > 0.0, start + 1, start)] = most
            lower[index, np.where(least < 0.0, start + 1, start)] = least
        lower[:, 6] = upper[:, 7] = 1.0
        return lower, upper

    def mean_width(self, ends: Array) -> float:
        """Mean over the samples of the width of the whole band, rigid bodies included."""
        lower, upper = self.edges(ends)
        return float(np.mean(upper - lower + (self.high - self.low)))

    def width_weights(self) -> Array:
        """Weights w (8,) of the mean width of the band of friction, rotor and disturbance: w @ ends."""
        down, up = self._may_go()
        weights = np.zeros(ENDS)
        weights[3] = np.mean(up.astype(float) + down)
        weights[2] = weights[3] - 2.0
        for start, rate, noise in ((0, self.dq, self.dq_noise), (4, self.ddq, self.ddq_noise)):
            least, most = rate - noise, rate + noise
            weights[start + 1] = np.mean(np.maximum(most, 0.0) - np.minimum(least, 0.0))
            weights[start] = np.mean(np.minimum(most, 0.0) - np.maximum(least, 0.0))
        weights[6:] = -1.0, 1.0
        return weights

    def mean_effects(self) -> Array:
        """What a unit of width of each interval adds to the width of the band, mean over the samples, shape (4,)."""
        return np.array([np.mean(np.abs(self.dq)), 1.0, np.mean(np.abs(self.ddq)), 1.0])

    def outside(self, ends: Array) -> Array:
        """How far each sample lies outside the band of these ends, shape (N,); negative inside."""
        lower, upper = self.edges(ends)
        return np.asarray(np.maximum(self.least_upper() - upper, lower - self.most_lower()))

    def _may_go(self) -> tuple[Mask, Mask]:
        """Where the joint may be moving down, and up; both are true near standstill."""
        reach = self.dq_noise
        return self.dq - reach <= self.velocity_band, self.dq + reach >= -self.velocity_band

    def moving(self) -> tuple[int, int]:
        """How many samples are certainly moving down, and up."""
        down, up = self._may_go()
        return int(np.count_nonzero(~up)), int(np.count_nonzero(~down))
