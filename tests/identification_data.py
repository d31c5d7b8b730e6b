"""Synthetic recordings: Pinocchio inverse dynamics along Fourier motions, friction, coloured noise."""

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.identify.base_runs import TorqueRun
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain

VISCOUS = (8.0, 9.5, 6.0, 4.0, 3.0, 3.5, 3.0, 3.0)
COULOMB = (5.0, 4.5, 4.0, 2.0, 1.5, 1.0, 1.0, 1.0)
"""Friction that no robot file knows, by joint: [N m s/rad] and [N m]."""


def fourier_motion(
    rng: np.random.Generator, n: int, duration: float, rate: float, harmonics: int = 5
) -> tuple[Array, Array, Array, Array]:
    """Times and random sums of harmonics of 0.1 Hz with exact derivatives: t, q, dq, ddq."""
    t = np.arange(0.0, duration, 1.0 / rate)
    q = np.tile(rng.uniform(-1.0, 1.0, n), (len(t), 1))
    dq, ddq = np.zeros_like(q), np.zeros_like(q)
    for k in range(1, harmonics + 1):
        w = 0.2 * np.pi * k
        a, b = 0.8 * rng.normal(size=(2, n)) / k
        s, c = np.sin(w * t)[:, None], np.cos(w * t)[:, None]
        q += a * s + b * c
        dq += w * (a * c - b * s)
        ddq -= w**2 * (a * s + b * c)
    return t, q, dq, ddq


def with_scaled_mass(robot: Robot, link: int, factor: float) -> Robot:
    """The robot with the masses of one link's bodies multiplied; centres of mass and tensors as they are."""
    bodies = []
    for placed in robot.bodies:
        body = placed.body
        mass = Uncertain.exact(body.mass.nominal * (factor if placed.link == link else 1.0))
        com, inertia = Uncertain.exact(body.com.nominal), Uncertain.exact(body.inertia.nominal)
        bodies.append(replace(placed, body=replace(body, mass=mass, com=com, inertia=inertia)))
    return replace(robot, bodies=tuple(bodies))


def recording(
    robot: Robot, rng: np.random.Generator, noise: float, duration: float = 30.0, rate: float = 100.0
) -> TorqueRun:
    """A run of a robot with its own rotors, and friction that no file knows.

    Parameters
    ----------
    noise : standard deviation of the torque error relative to the torque's RMS; first-order autoregressive with 0.9
    """
    t, q, dq, ddq = fourier_motion(rng, robot.dof, duration, rate)
    tau = inverse_dynamics(robot, q, dq, ddq)
    for j, joint in enumerate(robot.joints):
        rotor = joint.drive.gear_ratio**2 * float(joint.drive.rotor_inertia.nominal)
        tau[:, j] += rotor * ddq[:, j] + VISCOUS[j] * dq[:, j] + COULOMB[j] * np.sign(dq[:, j])
    error = lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], rng.normal(size=tau.shape), axis=0)
    size = noise * np.sqrt(np.mean(tau**2, axis=0))
    return TorqueRun("synthetic", t, q, dq, ddq, tau + size * error, np.abs(dq) > 0.02)
