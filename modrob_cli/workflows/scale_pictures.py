"""What the pictures of a scaled motion show."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.width_share import without_width
from modrob_cli.plot.scale import FactorMap, ScalePicture, TorqueCurves
from modrob_cli.scaling.factor_map import limit_use, speed_use
from modrob_cli.scaling.sampled import SampledFactors
from modrob_cli.workflows.scale_problem import ScaleProblem, published_links, ranges_by
from modrob_cli.workflows.scale_words import unit_of

_TIMES, _FACTORS = 2000, 160
_MAP_TIMES = 500
_MARGIN = 1.3
"""The map of factors goes this much beyond the answer; if there is none, up to ``_FALLBACK``."""
_FALLBACK = 3.0
_WORDS = {"exact": "exact range over all admissible parameters", "nominal": "nominal parameters only",
          "ianea": "published interval algorithm (IANEA*)"}  # fmt: skip


@dataclass(frozen=True)
class ScaleViews:
    """Data of the pictures."""

    torques: ScalePicture
    factors: FactorMap


def views(problem: ScaleProblem, sampled: SampledFactors, used: float | None) -> ScaleViews:
    """Compute what the pictures show; ``used``: the factor of the scaled motion."""
    t = np.linspace(0.0, problem.trajectory.duration, _TIMES)
    robot, names = problem.robot, problem.robot.joint_names
    said = "no factor is safe" if used is None else f"factor {used:.6g}, {problem.trajectory.duration / used:.6g} s"
    picture = ScalePicture(
        f"{robot.name}: torques along {problem.loaded.name}",
        f"{_WORDS[problem.options.method]}; {said}; line: nominal; dashed: limits that are near",
        names,
        tuple(unit_of(robot, j, "torque") for j in range(robot.dof)),
        problem.low,
        problem.high,
        _curves(problem, t, 1.0),
        None if used is None else _curves(problem, t, used),
        used,
    )
    return ScaleViews(picture, _map(problem, sampled, used))


def _curves(problem: ScaleProblem, t: Array, c: float) -> TorqueCurves:
    robot, x = problem.robot, problem.trajectory.sample(t, 2)
    state = (x[:, 0], c * x[:, 1], c * c * x[:, 2])
    if problem.options.method == "ianea":
        found = ianea(robot, *state, published_links(robot))
    else:
        found = exact_bounds(without_width(robot) if problem.options.method == "nominal" else robot, *state)
    return TorqueCurves(t / c, found.nominal, found.lower, found.upper)


def _map(problem: ScaleProblem, sampled: SampledFactors, used: float | None) -> FactorMap:
    options, robot = problem.options, problem.robot
    top = min(options.max_factor, _FALLBACK if used is None else _MARGIN * (sampled.factor or used))
    top = max(top, _MARGIN * options.min_factor)
    t = np.linspace(0.0, problem.trajectory.duration, _MAP_TIMES)
    c = np.linspace(options.min_factor, top, _FACTORS)
    x = problem.trajectory.sample(t, 2)
    ranges = ranges_by(robot, options.method)(x[:, 0], x[:, 1], x[:, 2])
    use, joint = limit_use(ranges, problem.limits, c)
    fast, fast_joint = speed_use(robot, problem.trajectory, t, c)
    joint = np.where(fast > use, fast_joint, joint)
    return FactorMap(t, c, np.maximum(use, fast), joint, robot.joint_names, tuple(sampled.free))
