"""Recordings of a simulated arm with known friction, by Pinocchio; noise correlated as that of real drives is."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.log import JointLog

URDF = """<?xml version="1.0"?>
<robot name="three">
  <link name="base"/>
  <link name="a"><inertial><origin xyz="0 0 0.1"/><mass value="4"/>
    <inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.04"/></inertial></link>
  <link name="b"><inertial><origin xyz="0.2 0 0.02"/><mass value="3"/>
    <inertia ixx="0.02" ixy="0.001" ixz="0" iyy="0.06" iyz="0" izz="0.06"/></inertial></link>
  <link name="c"><inertial><origin xyz="0.15 0.01 0"/><mass value="1.5"/>
    <inertia ixx="0.01" ixy="0" ixz="0.002" iyy="0.03" iyz="0" izz="0.03"/></inertial></link>
  <joint name="waist" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
    <limit effort="100" velocity="5" lower="-3" upper="3"/></joint>
  <joint name="shoulder" type="revolute"><origin xyz="0 0 0.2"/><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
    <limit effort="100" velocity="5" lower="-3" upper="3"/></joint>
  <joint name="elbow" type="revolute"><origin xyz="0.4 0 0"/><parent link="b"/><child link="c"/><axis xyz="0 1 0"/>
    <limit effort="100" velocity="5" lower="-3" upper="3"/></joint>
</robot>
"""

TERMS = ("offset", "coulomb", "viscous", "reflected_inertia")
TRUTH = np.array([[0.5, 6.0, 9.0, 0.8], [-1.0, 8.0, 12.0, 1.2], [0.2, 2.5, 3.0, 0.3]])
"""Of each joint, in the order of :data:`TERMS`."""

NOISE = np.array([1.0, 1.5, 0.5])
"""Standard deviation of the torque noise, [N m]."""


@dataclass(frozen=True)
class Recording:
    """One simulated run and what the noise-free motion was."""

    log: JointLog
    q: Array
    dq: Array
    ddq: Array
    rigid: Array


def fourier_motion(t: Array, rng: np.random.Generator, joints: int = 3) -> tuple[Array, Array, Array]:
    """Sums of five sines of 0.1 to 0.5 Hz per joint, as exciting trajectories are; exact derivatives."""
    w = 2.0 * np.pi * 0.1 * np.arange(1, 6)
    amplitude = rng.uniform(0.1, 0.35, (5, joints))
    angle = t[:, None, None] * w[:, None] + rng.uniform(0.0, 2.0 * np.pi, (5, joints))
    q = (amplitude * np.sin(angle)).sum(axis=1)
    dq = (amplitude * w[:, None] * np.cos(angle)).sum(axis=1)
    return q, dq, -(amplitude * w[:, None] ** 2 * np.sin(angle)).sum(axis=1)


def coloured_noise(count: int, rate: float, rng: np.random.Generator, joints: int = 3) -> Array:
    """Unit variance: two thirds of the power with a correlation time of 0.1 s (gears), one third white (sensor)."""
    from scipy.signal import lfilter

    pole = np.exp(-1.0 / (0.1 * rate))
    driven = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.normal(size=(count + int(rate), joints)), axis=0)
    return np.asarray(np.sqrt(2 / 3) * driven[int(rate) :] + np.sqrt(1 / 3) * rng.normal(size=(count, joints)))


def rigid_torque(q: Array, dq: Array, ddq: Array) -> Array:
    """Inverse dynamics by Pinocchio."""
    import pinocchio as pin

    model: Any = pin.buildModelFromXML(URDF)
    data = model.createData()
    return np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])


def record(
    seed: int,
    duration: float = 20.0,
    rate: float = 200.0,
    truth: Array = TRUTH,
    noise: float = 1.0,
    q_noise: float = 2e-5,
    recorded_velocity: bool = False,
) -> Recording:
    """One run; ``noise`` scales :data:`NOISE`, ``q_noise`` [rad] is white (an encoder's)."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(duration * rate)) / rate
    q, dq, ddq = fourier_motion(t, rng)
    rigid = rigid_torque(q, dq, ddq)
    tau = rigid + truth[:, 0] + truth[:, 1] * np.sign(dq) + truth[:, 2] * dq + truth[:, 3] * ddq
    tau = tau + noise * NOISE * coloured_noise(len(t), rate, rng)
    measured = q + q_noise * rng.normal(size=q.shape)
    velocity = dq + 1e-3 * rng.normal(size=q.shape) if recorded_velocity else None
    log = JointLog(f"run{seed}", ("waist", "shoulder", "elbow"), t, measured, velocity, tau)
    return Recording(log, q, dq, ddq, rigid)
