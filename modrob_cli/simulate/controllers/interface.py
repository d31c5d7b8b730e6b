"""What every controller is: a function of time, measured and desired state that gives joint torques."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.errors import UsageError
from modrob_cli.model.scenario import Control, GainValue
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.simulate.control_model import ControlModel

Sign = Literal["any", "not negative", "positive"]

_STATES = 50
"""States along the motion at which the inertia that each joint feels is looked at."""


class Desired(NamedTuple):
    """Where the motion wants the arm to be: position, velocity, acceleration, shape (n,) each."""

    q: Array
    dq: Array
    ddq: Array


class Controller(Protocol):
    """One controller for one run; it may keep a state of its own between calls."""

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """Motor torque at the joints until the next call, shape (n,), [N m] or [N].

        Parameters
        ----------
        t : time since the start [s]; calls come at 0, T, 2 T, ...
        q, dq : measured position and velocity, shape (n,)
        """
        ...


class Perturbation(NamedTuple):
    """What a controller knew of its perturbation w at its last command, shape (n,) each. [D] (3.6), (3.26).

    Attributes
    ----------
    q, dq : measured state;  dq_a, ddq_a : what C and M are multiplied by
    nominal : nominal torque there, with the friction that is compensated
    lower, upper : [Phi], bounds of w = torque of the true arm there - nominal
    """

    q: Array
    dq: Array
    dq_a: Array
    ddq_a: Array
    nominal: Array
    lower: Array
    upper: Array


@runtime_checkable
class BoundsPerturbation(Protocol):
    """A controller that bounds its perturbation; ``perturbation`` is that of the last command."""

    perturbation: Perturbation


@dataclass(frozen=True)
class ControlTask:
    """What a controller is made from.

    Attributes
    ----------
    model : nominal robot
    trajectory : the planned motion
    period : time between two commands [s]
    control : gains, and how friction is compensated
    links : interval parameters of the links in their D-H frames; only needed for ``bounds: ianea``
    """

    model: ControlModel
    trajectory: Trajectory
    period: float
    control: Control
    links: LinkBoxes | None = None

    def gain(self, name: str, default: GainValue | Array | None = None, sign: Sign = "any") -> Array:
        """One gain for each joint, shape (n,).

        Raises
        ------
        UsageError
            If it is not given and has no default, has another number of values than the robot has joints, or one of
            them is not finite or of the wrong sign.
        """
        value = self.control.gains.get(name, default)
        if value is None:
            raise UsageError(f"controller: the gain {name} is missing; give it in a scenario, under control: gains")
        values = np.asarray(value, dtype=float)
        if values.shape not in ((), (self.model.dof,)):
            raise UsageError(f"controller: gain {name}: found {values.size} values for {self.model.dof} joints")
        if not np.isfinite(values).all():
            raise UsageError(f"controller: gain {name}: expected finite numbers")
        worst = float(values.min())
        if worst < 0.0 and sign != "any" or worst == 0.0 and sign == "positive":
            least = "numbers > 0" if sign == "positive" else "numbers >= 0"
            raise UsageError(f"controller: gain {name}: found {worst:.6g}, expected {least}")
        return np.array(np.broadcast_to(values, (self.model.dof,)))

    def joint_inertia(self) -> Array:
        """What a torque at one joint has to accelerate while the others are free, 1 / (M^-1)_ii, shape (n,).

        The smallest along the motion, rotors included, [kg m^2] or [kg]; 0 where M has no inverse. Gains in proportion
        to it suit every arm: the eigenvalues of M^-1 times a matrix that has it on its diagonal add up to n at most.
        """
        times = np.linspace(0.0, self.trajectory.duration, _STATES)
        along = [self.model.inertia(q) for q in self.trajectory.sample(times, 0)[:, 0]]
        try:
            return np.asarray(np.min([1.0 / np.diag(np.linalg.inv(M)) for M in along], axis=0))
        except np.linalg.LinAlgError:
            return np.zeros(self.model.dof)

    def check_gains(self, known: Sequence[str]) -> None:
        """Make sure that every gain that is given is known.

        Raises
        ------
        UsageError
            If one is not.
        """
        unknown = [name for name in self.control.gains if name not in known]
        if unknown:
            raise UsageError(f"controller: found the gain {', '.join(unknown)}, expected some of {', '.join(known)}")

    def sign(self, dq: Array) -> Array:
        """Direction of motion, shape (n,), with a straight line within the friction band."""
        band = self.control.friction_band
        return np.clip(dq / band, -1.0, 1.0) if band > 0.0 else np.sign(dq)

    def friction_velocity(self, dq: Array, desired_dq: Array) -> Array:
        """Velocity from which friction is computed, measured or desired, shape (n,)."""
        return desired_dq if self.control.friction == "desired" else dq

    def friction(self, dq: Array, desired_dq: Array) -> Array:
        """Nominal viscous and Coulomb friction that the controller compensates, shape (n,)."""
        if self.control.friction == "none":
            return np.zeros(self.model.dof)
        velocity = self.friction_velocity(dq, desired_dq)
        return np.asarray(self.model.viscous * velocity + self.model.coulomb * self.sign(velocity))
