"""Series and words of the picture of bounded-error identification."""

from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.identify.bounded_error import JointBounds
from modrob_cli.identify.bounded_ranges import RecordedMotion
from modrob_cli.identify.bounded_samples import ARMATURE, JointSamples
from modrob_cli.model.robot import Robot
from modrob_cli.plot.bounded import BoundedPicture, JointPicture
from modrob_cli.workflows.bounded_summary import unit

GRID = 400
PAUSE = 0.02
"""Gap between logs in the picture, as a share of all their time."""


def bounded_picture(
    robot: Robot,
    motion: RecordedMotion,
    samples: Sequence[JointSamples],
    found: Sequence[JointBounds],
    bounds: TorqueBounds,
) -> BoundedPicture:
    """Everything that the picture shows."""
    t, starts = _one_after_the_other(motion)
    joints = tuple(_joint(robot, j, samples[j], found[j]) for j in range(robot.dof))
    logs = len(starts) + 1
    subtitle = f"{len(motion)} samples of {logs} log{'s' if logs > 1 else ''}; bounds hold every sample not left out"
    title = f"{robot.name}: bounded-error identification"
    return BoundedPicture(title, subtitle, joints, t, starts, motion.tau, bounds.lower, bounds.upper)


def _joint(robot: Robot, j: int, samples: JointSamples, found: JointBounds) -> JointPicture:
    rotor, fixed = np.zeros((4, 2)), found.ends.copy()
    rotor[ARMATURE], fixed[ARMATURE] = found.ends[ARMATURE], 0.0
    rotor_low, rotor_high = samples.edges(rotor.ravel())
    grid = _velocities(samples)
    still = np.zeros_like(grid)
    at_rest = JointSamples(
        dq=grid, ddq=still, tau=still, low=still, high=still,
        velocity_band=samples.velocity_band, dq_noise=samples.dq_noise,
    )  # fmt: skip
    band_low, band_high = at_rest.edges(fixed.ravel())
    reach = 0.5 * (found.ends[3, 1] - found.ends[3, 0])
    figure = unit(robot, j)
    words = {"disturbance": "one value each", "least": "least width", "consistent": "all consistent values"}
    return JointPicture(
        name=robot.joints[j].name,
        unit=figure,
        prismatic=robot.joints[j].type == "prismatic",
        left_note=f"{words[found.spread]}; disturbance +-{reach:.3g} {figure}",
        right_note=f"mean width {found.mean_width:.3g} {figure}",
        velocity=samples.dq,
        rest_low=samples.least_upper() - rotor_high,
        rest_high=samples.most_lower() - rotor_low,
        grid=grid,
        band_low=band_low,
        band_high=band_high,
        active=np.unique(np.array([item.index for item in found.active], dtype=np.intp)),
        left_out=found.left_out,
    )


def _velocities(samples: JointSamples) -> Array:
    """Velocities of the curves, with both sides of every jump of the band."""
    low, high = float(np.min(samples.dq)), float(np.max(samples.dq))
    edge = samples.velocity_band + samples.dq_noise
    jumps = [np.nextafter(sign * edge, toward) for sign in (-1.0, 1.0) for toward in (-np.inf, np.inf)]
    grid = np.concatenate([np.linspace(low, high, GRID), [*jumps, -edge, edge]])
    return np.unique(np.clip(grid, low, high))


def _one_after_the_other(motion: RecordedMotion) -> tuple[Array, Array]:
    """Times with the logs in a row, and where each begins, without the first."""
    t = motion.t.copy()
    numbers = np.unique(motion.run)
    pause = PAUSE * float(sum(np.ptp(motion.t[motion.run == number]) for number in numbers))
    end, starts = 0.0, []
    for k, number in enumerate(numbers):
        mine = motion.run == number
        t[mine] += end - motion.t[mine][0] if k else 0.0
        if k:
            starts.append(end - 0.5 * pause)
        end = float(t[mine][-1]) + pause
    return t, np.array(starts)
