r"""Forward dynamics of the true arm with dry friction.

.. math:: M(q)\,\ddot q + c(q, \dot q) + g(q) = \tau - F_v\,\dot q - F_c\,s - \tau_o + \sum_k J_k^T f_k

with the reflected rotor inertia on the diagonal of M, the constant torque tau_o of friction band and disturbance, and
the directions s in which the joints slide. Joints that dry friction or an end stop holds (s = 0) do not accelerate.
"""

from typing import Any, NamedTuple

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.errors import NumericalError
from modrob_cli.model.scenario import Contact
from modrob_cli.simulate.contacts import ContactForces
from modrob_cli.simulate.truth import TrueRobot

Rates = tuple[Array, float]
"""Accelerations (n,) and power [W]."""

_SINGULAR = 1e-13
"""Smallest eigenvalue of the inertia matrix, scaled to ones on its diagonal, that is not taken for zero."""
_LOCK = 1e30
"""Rotor inertia that locks a joint [kg m^2]: nothing of other joints' accelerations depends on its size."""


class Load(NamedTuple):
    """What acts on the arm during a step.

    Attributes
    ----------
    constant : torque that does not change: motor, dry friction, friction band and disturbance, shape (n,)
    sign : direction in which each joint moves; 0 where it is held or has neither dry friction nor end stops, (n,)
    active : numbers of the contacts that push
    held : indices of joints that do not accelerate
    """

    constant: Array
    sign: Array
    active: tuple[int, ...] = ()
    held: tuple[int, ...] = ()


class ForwardDynamics:
    """Accelerations, torques and energy of a true robot. Not safe to share between threads: Pinocchio's work space.

    Attributes
    ----------
    forces : contact forces
    viscous, coulomb : true friction, shape (n,)
    armature : reflected rotor inertia, shape (n,), [kg m^2] or [kg]
    """

    def __init__(self, truth: TrueRobot, contacts: tuple[Contact, ...] = ()) -> None:
        import pinocchio as pin

        self._pin = pin
        robot = truth.robot
        drives = [joint.drive for joint in robot.joints]
        friction = [joint.friction for joint in robot.joints]
        self._names = robot.joint_names
        self.offset = truth.offset
        self.viscous = np.array([float(part.viscous.nominal) for part in friction])
        self.coulomb = np.array([float(part.coulomb.nominal) for part in friction])
        self.armature = np.array([drive.gear_ratio**2 * float(drive.rotor_inertia.nominal) for drive in drives])
        self._model: Any = build_model(robot)
        self._model.armature = self.armature
        self.forces = ContactForces(self._model, contacts)
        self._data: Any = self._model.createData()
        self._with_locks: Any = build_model(robot)
        self._with_locks.armature = self.armature
        self._locked: tuple[int, ...] = ()
        self._locked_joints = np.array(self._locked, dtype=np.intp)

    def load(self, tau: Array, sign: Array, active: tuple[int, ...], held: tuple[int, ...] = ()) -> Load:
        """What acts under motor torque tau (n,) while the joints slide in these directions."""
        return Load(tau - self.offset - self.coulomb * sign, sign, active, held)

    def net_torque(self, t: float, q: Array, dq: Array, load: Load) -> Array:
        """Torque on the rigid bodies but for gravity and what holds joints, shape (n,)."""
        net = load.constant - self.viscous * dq
        return net + self.forces.torque(load.active, t, q) if load.active else np.asarray(net)

    def rates(self, t: float, q: Array, dq: Array, load: Load) -> Rates:
        """Accelerations (n,), exactly zero for held joints, and the power of all torques but gravity [W]."""
        net = self.net_torque(t, q, dq, load)
        return self._accelerations(q, dq, net, load.held), dq.dot(net)

    def _accelerations(self, q: Array, dq: Array, net: Array, held: tuple[int, ...]) -> Array:
        """Joint accelerations (n,) where a rotor of next to infinite inertia locks each held joint."""
        if held != self._locked:
            armature = self.armature.copy()
            armature[list(held)] = _LOCK
            self._with_locks.armature = armature
            self._locked, self._locked_joints = held, np.array(held, dtype=np.intp)
        ddq: Array = self._pin.aba(self._with_locks, self._data, q, dq, net).copy()  # it is Pinocchio's work space
        if held:
            ddq[self._locked_joints] = 0.0
        return ddq

    def holding_torque(self, t: float, q: Array, dq: Array, ddq: Array, load: Load) -> Array:
        """Torques (n,) that hold joints at these accelerations, with friction and end stops; elsewhere about zero."""
        return np.asarray(self.inverse(q, dq, ddq) - self.net_torque(t, q, dq, load))

    def inertia(self, q: Array) -> Array:
        """M(q) with the rotors, shape (n, n)."""
        upper = np.triu(self._pin.crba(self._model, self._data, q))
        return np.asarray(upper + np.triu(upper, 1).T)

    def inverse_inertia(self, q: Array) -> Array:
        """Inverse of M(q) with the rotors, shape (n, n), symmetric."""
        upper = np.triu(self._pin.computeMinverse(self._model, self._data, q))
        return np.asarray(upper + np.triu(upper, 1).T)

    def inverse(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Torque that moves the rigid bodies and the rotors like this, shape (n,)."""
        return np.array(self._pin.rnea(self._model, self._data, q, dq, ddq))

    def check_inertia(self, q: Array) -> None:
        """Make sure that the inertia matrix is positive definite, whatever the units of the joints.

        Raises
        ------
        NumericalError
            If it is not.
        """
        M = self.inertia(q)
        without = [name for name, own in zip(self._names, np.diag(M), strict=True) if not own > 0.0]
        advice = "every joint needs a body with mass or a rotor_inertia"
        if without:
            raise NumericalError(f"no inertia acts on {', '.join(without)}; {advice}")
        scale = 1.0 / np.sqrt(np.diag(M))
        if not np.linalg.eigvalsh(M * np.outer(scale, scale))[0] > _SINGULAR:
            raise NumericalError(f"the inertia matrix of the true robot is singular at the start; {advice}")

    def decay_rate(self, q: Array) -> float:
        """Fastest rate at which viscous friction slows motion down [1/s]; no step may be longer than its inverse."""
        rates = np.linalg.eigvals(self.inverse_inertia(q) * self.viscous)
        return float(np.abs(rates).max(initial=0.0))

    def kinetic_energy(self, q: Array, dq: Array) -> float:
        """Kinetic energy of bodies and rotors [J]."""
        return float(self._pin.computeKineticEnergy(self._model, self._data, q, dq))

    def potential_energy(self, q: Array) -> float:
        """Potential energy of the bodies [J]."""
        return float(self._pin.computePotentialEnergy(self._model, self._data, q))


def runge_kutta(
    dynamics: ForwardDynamics, t: float, q: Array, dq: Array, first: Rates, load: Load, h: float
) -> tuple[Array, Array, float]:
    """One step of the classical Runge-Kutta method: position, velocity and work after h seconds.

    Parameters
    ----------
    first : accelerations (n,) and power at the start
    """
    half, sixth = 0.5 * h, h / 6.0
    a1, p1 = first
    v2 = dq + half * a1
    a2, p2 = dynamics.rates(t + half, q + half * dq, v2, load)
    v3 = dq + half * a2
    a3, p3 = dynamics.rates(t + half, q + half * v2, v3, load)
    v4 = dq + h * a3
    a4, p4 = dynamics.rates(t + h, q + h * v3, v4, load)
    return (
        q + sixth * (dq + 2.0 * (v2 + v3) + v4),
        dq + sixth * (a1 + 2.0 * (a2 + a3) + a4),
        sixth * float(p1 + 2.0 * (p2 + p3) + p4),
    )
