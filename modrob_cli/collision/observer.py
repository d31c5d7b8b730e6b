r"""Generalized-momentum observer: the usual estimate of the external torque without accelerations.

.. math:: \dot{\hat p} = \tau + C^T(q, \dot q)\,\dot q - g(q) - \tau_f(\dot q) + r, \qquad r = K (p - \hat p),
          \qquad p = M(q)\,\dot q

(De Luca and Mattone 2003; Haddadin et al. 2017). With a true model dr/dt = K (tau_ext - r). M and C are Pinocchio's,
rotors are added to M; the model is the nominal one.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import drive_nominal
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.model.robot import Robot


@dataclass(frozen=True)
class MomentumTerms:
    """What the observer needs of a motion, shape (N, n) each.

    Attributes
    ----------
    t : shape (N,), [s]
    p : momentum M(q) dq
    drift : tau + C' dq - g - friction: what changes the momentum without contact
    """

    t: Array
    p: Array
    drift: Array


def momentum_terms(robot: Robot, t: Array, q: Array, dq: Array, tau: Array) -> MomentumTerms:
    """Evaluate the nominal model along measured positions, velocities and torques of shape (N, n)."""
    import pinocchio as pin

    model = build_model(robot)
    data = model.createData()
    rotors = np.array([joint.drive.gear_ratio**2 * float(joint.drive.rotor_inertia.nominal) for joint in robot.joints])
    p, drift = np.empty_like(q), np.empty_like(q)
    for k, (position, velocity) in enumerate(zip(np.ascontiguousarray(q), np.ascontiguousarray(dq), strict=True)):
        M = pin.crba(model, data, position)
        C = pin.computeCoriolisMatrix(model, data, position, velocity)
        upper = np.triu(M)
        p[k] = upper @ velocity + np.triu(upper, 1).T @ velocity + rotors * velocity
        drift[k] = C.T @ velocity - pin.computeGeneralizedGravity(model, data, position)
    still = np.zeros(len(q))
    friction = np.stack([drive_nominal(joint, dq[:, i], still) for i, joint in enumerate(robot.joints)], axis=1)
    return MomentumTerms(t, p, drift + tau - friction)


class ObserverRun:
    """The observer at work on one run, which comes piece by piece.

    Parameters
    ----------
    gain : K > 0, the same for all joints [1/s]; or several at once, shape (G, 1)
    """

    def __init__(self, gain: float | Array) -> None:
        self._gain = np.asarray(gain, dtype=float)
        self._last: tuple[float, Array, Array, Array] | None = None

    def add(self, terms: MomentumTerms) -> Array:
        """Estimate r of the external torque at the next samples, shape (N, n) or (N, G, n); it starts at 0."""
        if self._last is None:
            start = np.zeros(np.broadcast_shapes(self._gain.shape, terms.p[0].shape))
            self._last = float(terms.t[0]), terms.p[0], terms.drift[0], start
        t, p, drift, before = self._last
        steps = np.diff(terms.t, prepend=t)
        mean = 0.5 * (terms.drift + np.concatenate([drift[None], terms.drift[:-1]]))
        pushed = np.diff(terms.p, axis=0, prepend=p[None]) - mean * steps[:, None]
        r = np.empty((len(steps), *before.shape))
        # r_k (1 + K h / 2) = r_{k-1} (1 - K h / 2) + K (change of p - integral of the drift).
        halves = 0.5 * self._gain * steps.reshape(-1, *[1] * self._gain.ndim)
        decay, grow = (1.0 - halves) / (1.0 + halves), self._gain / (1.0 + halves)
        for k, push in enumerate(pushed):
            before = decay[k] * before + grow[k] * push
            r[k] = before
        self._last = float(terms.t[-1]), terms.p[-1], terms.drift[-1], before
        return r


def external_torque(terms: MomentumTerms, gain: float) -> Array:
    """Estimate r of the external torque, shape (N, n), by the trapezoidal rule; it starts at 0.

    Parameters
    ----------
    gain : K > 0, the same for all joints [1/s]
    """
    return ObserverRun(gain).add(terms)
