"""Samples of one joint made from known friction, for tests of bounded-error identification."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.bounded_samples import JointSamples


@dataclass(frozen=True)
class Truth:
    """What made the samples: the true constants, and the bound of the noise."""

    viscous: float
    coulomb: float
    armature: float
    offset: float
    noise: float

    def values(self) -> Array:
        """In the order of the identified parameters."""
        return np.array([self.viscous, self.coulomb, self.armature, self.offset])


def fourier_motion(rng: np.random.Generator, count: int, harmonics: int = 3) -> tuple[Array, Array]:
    """Velocity and acceleration (N,) of a random periodic motion over 10 s, in closed form."""
    t = np.linspace(0.0, 10.0, count)
    dq, ddq = np.zeros(count), np.zeros(count)
    for k in range(1, harmonics + 1):
        rate = 2.0 * np.pi * k / 10.0
        a, b = rng.uniform(-1.0, 1.0, 2)
        dq += a * np.cos(rate * t) + b * np.sin(rate * t)
        ddq += rate * (b * np.cos(rate * t) - a * np.sin(rate * t))
    return dq, ddq


def random_truth(rng: np.random.Generator) -> Truth:
    """Friction of the size that arms have; one in four without rotor."""
    armature = 0.0 if rng.random() < 0.25 else float(rng.uniform(0.01, 2.0))
    viscous, coulomb = float(rng.uniform(0.1, 20.0)), float(rng.uniform(0.1, 10.0))
    return Truth(viscous, coulomb, armature, float(rng.uniform(-2.0, 2.0)), float(rng.uniform(0.05, 1.0)))


def random_samples(rng: np.random.Generator, truth: Truth, count: int, rigid_width: float = 0.0) -> JointSamples:
    """Samples whose true rigid torque lies anywhere in a range of that width, and whose noise is within its bound.

    The noise is uniform, a sine, or jumps between both ends of its bound, by turns. Within the velocity band the sign
    of the friction is anything in [-1, 1].
    """
    dq, ddq = fourier_motion(rng, count)
    band = 0.05
    sign = np.where(np.abs(dq) <= band, rng.uniform(-1.0, 1.0, count), np.sign(dq))
    kind = int(rng.integers(3))
    shape = (
        rng.uniform(-1.0, 1.0, count),
        np.sin(np.linspace(0.0, 40.0, count)),
        rng.choice([-1.0, 1.0], count),
    )[kind]
    rigid = 10.0 * np.sin(np.linspace(0.0, 7.0, count))
    low = rigid - rigid_width * rng.random(count)
    high = low + rigid_width
    true_rigid = low + (high - low) * rng.random(count)
    tau = true_rigid + truth.viscous * dq + truth.coulomb * sign + truth.armature * ddq + truth.offset
    return JointSamples(
        dq=dq, ddq=ddq, tau=tau + truth.noise * shape, low=low, high=high, velocity_band=band
    )  # fmt: skip
