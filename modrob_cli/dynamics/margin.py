r"""A proven bound of the rounding error of torques that are computed in round-to-nearest.

Steps of the proof, with u = 2^-53 and N joints:

1. Every torque is a sum of products of: entries of constant rotations, cosines and sines, lengths, velocities,
   accelerations, gravity, masses, centres of mass and tensors. Replace every factor by a bound of its absolute value
   (vectors by a bound of their length) and every difference by a sum; call the result S_j. The recursion below
   computes it: W, A, a bound angular velocity, angular and linear acceleration; the rest force and moment.
2. A term that passes through k roundings is off by at most k u / (1 - k u) times its bound (Higham, *Accuracy and
   Stability of Numerical Algorithms*, lemma 3.1), whatever the order of the sums.
3. Per joint of the chain, a vector passes through: the constant rotation (3 products and sums, entries that are off by
   up to 4 u, entries up to u left out), the turn by q (3, cosine and sine within 4 u each) and the recursion's own
   sums and cross products (fewer than 12). Vectors (3 components) multiply this by at most sqrt(3). That is below
   50 u per joint outward for the motion, and as much for the levers. Terms of a body in its own frame add fewer than
   50 u, the range over its box fewer than 50 u, sums over B bodies B u.
4. So the error of joint j is below (100 N + 100 + B) u S_j to first order. ``roundings`` is (200 N + 400) u S_j, which
   leaves 100 N + 200 for the higher orders, the rounding of S_j itself and up to ``most_bodies`` = 100 + 50 N bodies.
5. Products that underflow lose up to 2^-1075 each, times factors below 1e30: ``UNDERFLOW`` covers it.

NumPy's cos and sin were within 0.52 ulp of the exact value for angles up to 1e6 rad where this was measured; the proof
allows 4 u, and a test holds that (tests/property/test_exact_bounds.py).
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.body import RigidBody
from modrob_cli.model.robot import Robot

UNIT = 2.0**-53
UNDERFLOW = 1e-290


def roundings(dof: int) -> float:
    """Factor of u S_j that bounds the error of a torque, see the module's text."""
    return 200.0 * dof + 400.0


def most_bodies(dof: int) -> int:
    """Number of bodies that the proof covers; a robot with more is refused."""
    return 100 + 50 * dof


@dataclass(frozen=True)
class BodySize:
    """Bounds of a body: mass, distance of its centre of mass from the link's origin, size of its tensor."""

    link: int
    mass: float
    distance: float
    inertia: float

    @classmethod
    def of(cls, link: int, pose: Array, body: RigidBody) -> "BodySize":
        """From a placed body and its box."""
        com = float(np.linalg.norm(body.com.interval.mag))
        weights = np.array([1.0, 2.0, 2.0, 1.0, 2.0, 1.0])
        inertia = float(np.sqrt(weights @ body.inertia.interval.mag**2))
        return cls(link, float(body.mass.interval.sup), float(np.linalg.norm(pose[:3, 3])) + com, inertia)


def torque_magnitude(robot: Robot, q: Array, dq: Array, ddq: Array) -> Array:
    """Bound S of the sums of absolute values behind each torque, shape (n, T), for states of shape (n, T)."""
    sizes = [BodySize.of(placed.link, placed.pose, placed.body) for placed in robot.bodies]
    lengths: list[Array] = []
    forces: list[Array] = []
    moments: list[Array] = []
    W = A = np.zeros(q.shape[1])
    a = np.full(q.shape[1], float(np.linalg.norm(robot.gravity)))
    for i, joint in enumerate(robot.joints):
        travel = np.abs(q[i]) if joint.type == "prismatic" else np.zeros_like(W)
        length = travel + float(np.linalg.norm(joint.placement[:3, 3]))
        speed, push = np.abs(dq[i]), np.abs(ddq[i])
        a = a + (A + W * W) * length
        if joint.type == "revolute":
            A = A + push + W * speed
            W = W + speed
        else:
            a = a + push + 2.0 * W * speed
        spin = A + W * W
        carried = [size for size in sizes if size.link == i + 1]
        own = [size.mass * (a + spin * size.distance) for size in carried]
        lengths.append(length)
        forces.append(sum(own, start=np.zeros_like(W)))
        turning = [size.distance * force + size.inertia * spin for size, force in zip(carried, own, strict=True)]
        moments.append(sum(turning, start=np.zeros_like(W)))
    return _collect(robot, lengths, forces, moments)


def _collect(robot: Robot, lengths: list[Array], forces: list[Array], moments: list[Array]) -> Array:
    """Sum forces and moments from the tip to each joint."""
    out = np.empty((robot.dof, len(forces[0])))
    force = moment = np.zeros(len(forces[0]))
    for i in reversed(range(robot.dof)):
        moment = moment + (lengths[i + 1] * force if i + 1 < robot.dof else 0.0) + moments[i]
        force = force + forces[i]
        out[i] = moment if robot.joints[i].type == "revolute" else force
    return out


def rounding_margin(dof: int, magnitude: Array) -> Array:
    """Bound of the rounding error of torques whose terms have absolute values that sum up to ``magnitude``.

    ``magnitude`` is that of the rigid bodies (:func:`torque_magnitude`) plus that of the drives' terms, which pass
    through fewer roundings; any shape.
    """
    return roundings(dof) * UNIT * magnitude + UNDERFLOW
