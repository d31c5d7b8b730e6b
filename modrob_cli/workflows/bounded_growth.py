"""How much the rigid bodies' boxes would have to grow: figures for JSON."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.arrays import Indices
from modrob_cli.identify.bounded_error import JointBounds
from modrob_cli.identify.bounded_growth import box_growth, mass_growth
from modrob_cli.identify.bounded_ranges import MotionNoise, RecordedMotion, rigid_bodies_of
from modrob_cli.identify.bounded_samples import PARAMETERS, JointSamples
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.bounded_options import BoundedOptions

MOST_SAMPLES = 20_000
"""Of longer logs so many evenly picked samples, and all that decide the intervals, tell how much boxes would grow."""

HALF = 0.5
"""Without a stated noise: growth that takes over this share of the disturbance."""


def growth_result(
    robot: Robot,
    motion: RecordedMotion,
    noise: MotionNoise,
    samples: Sequence[JointSamples],
    found: Sequence[JointBounds],
    options: BoundedOptions,
) -> dict[str, Any]:
    """Growth that leaves the noise, or half the disturbance where none is stated or where it is explained already."""
    target = np.array(
        [
            stated if 0.0 < stated < bounds.least_disturbance else HALF * bounds.least_disturbance
            for stated, bounds in zip(options.torque_noise(robot.dof), found, strict=True)
        ]
    )
    picked = _picked(len(motion), found)
    part, bodies = motion.picked(picked), rigid_bodies_of(robot)
    few = [joint.picked(picked) for joint in samples]
    known = [
        {k: bounds.ends[k].tolist() for k, name in enumerate(PARAMETERS) if name in bounds.kept} for bounds in found
    ]
    masses = mass_growth(bodies, part, noise, few, known, target)
    return {
        "samples": len(part),
        "box_factor": box_growth(bodies, part, noise, few, known, target),
        "joints": [
            {
                "name": joint.name,
                "disturbance": found[j].least_disturbance,
                "target": float(target[j]),
                "all_masses": masses.all_bodies[j],
                "one_mass": masses.one_body[j],
            }
            for j, joint in enumerate(robot.joints)
        ],
    }


def _picked(count: int, found: Sequence[JointBounds]) -> Indices:
    """Evenly picked samples and those that decide, without those that were left out at any joint."""
    even = np.unique(np.linspace(0, count - 1, min(count, MOST_SAMPLES)).astype(np.intp))
    active = np.array([item.index for bounds in found for item in bounds.active], dtype=np.intp)
    left_out = np.concatenate([bounds.left_out for bounds in found])
    return np.setdiff1d(np.union1d(even, active), left_out)
