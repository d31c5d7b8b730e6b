"""What a model-based controller knows: the nominal robot, evaluated one state at a time."""

from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.model.robot import Robot


class ControlModel:
    """Nominal rigid bodies, rotors and friction. Not safe to share between threads: Pinocchio's work space.

    Attributes
    ----------
    dof : number of joints
    viscous, coulomb : nominal friction, shape (n,)
    armature : nominal reflected rotor inertia, shape (n,)
    """

    def __init__(self, robot: Robot) -> None:
        import pinocchio as pin

        self._pin = pin
        self.robot = robot
        self.dof = robot.dof
        friction, drives = ([getattr(joint, key) for joint in robot.joints] for key in ("friction", "drive"))
        self.viscous = np.array([float(part.viscous.nominal) for part in friction])
        self.coulomb = np.array([float(part.coulomb.nominal) for part in friction])
        self.armature = np.array([drive.gear_ratio**2 * float(drive.rotor_inertia.nominal) for drive in drives])
        self._model: Any = build_model(robot)
        self._model.armature = self.armature
        self._weightless: Any = build_model(robot)
        self._weightless.gravity.linear = np.zeros(3)
        self._weightless.armature = self.armature
        self._data: Any = self._model.createData()
        self._still = np.zeros(self.dof)

    def inverse_dynamics(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Torque of bodies and rotors, M(q) ddq + C(q, dq) dq + g(q), shape (n,); friction excluded."""
        return np.array(self._pin.rnea(self._model, self._data, q, dq, ddq))

    def passivity_dynamics(self, q: Array, dq: Array, dq_a: Array, ddq_a: Array) -> Array:
        """M(q) ddq_a + C(q, dq) dq_a + g(q) with Christoffel's C, shape (n,). [D] (2.34).

        C(q, v) w is symmetric in (v, w), so it is c((v + w) / 2) - c((v - w) / 2) with c(v) = C(q, v) v.
        """
        first = self.inverse_dynamics(q, 0.5 * (dq + dq_a), ddq_a)
        second = self._pin.rnea(self._weightless, self._data, q, 0.5 * (dq - dq_a), self._still)
        return np.asarray(first - second)

    def coriolis(self, q: Array, dq: Array) -> Array:
        """C(q, dq), shape (n, n); Pinocchio's, with which dM/dt - 2 C is skew-symmetric too."""
        return np.array(self._pin.computeCoriolisMatrix(self._model, self._data, q, dq))

    def inertia(self, q: Array) -> Array:
        """M(q) with the rotors, shape (n, n)."""
        upper = np.triu(self._pin.crba(self._model, self._data, q))
        return np.asarray(upper + np.triu(upper, 1).T)
