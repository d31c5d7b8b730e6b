"""Sentences about scaling: what decides, and why no factor is safe."""

from dataclasses import asdict
from typing import Any

import numpy as np

from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.width_share import parameter_widths, ranked, without_width
from modrob_cli.model.robot import Robot
from modrob_cli.scaling.sampled import Critical, States
from modrob_cli.scaling.scaled_torque import bounds_at
from modrob_cli.workflows.scale_problem import ScaleProblem, ranges_by

_PER_TIME = {"velocity": "/s", "acceleration": "/s^2", "jerk": "/s^3"}
_SHOWN = 5


def unit_of(robot: Robot, joint: int, quantity: str) -> str:
    """Unit of a quantity of a joint."""
    revolute = robot.joints[joint].type == "revolute"
    if quantity == "torque":
        return "N m" if revolute else "N"
    return ("rad" if revolute else "m") + _PER_TIME[quantity]


def critical_data(problem: ScaleProblem, critical: Critical, factor: float) -> dict[str, Any]:
    """What decides, as plain data with a sentence; ``factor`` is the one in question."""
    name, unit = problem.robot.joints[critical.joint].name, unit_of(problem.robot, critical.joint, critical.quantity)
    what = "torque (or current)" if critical.quantity == "torque" else critical.quantity
    message = f"{name} reaches its {critical.side} {what} limit of {critical.limit:.6g} {unit}"
    message += f" at t = {critical.time:.6g} s of the unscaled motion"
    parameters = _parameters(problem, critical, factor) if critical.quantity == "torque" else []
    if parameters:
        message += f"; the uncertain parameter that matters most there is {parameters[0]['parameter']}"
    return {
        "joint": name,
        "quantity": critical.quantity,
        "side": critical.side,
        "time": critical.time,
        "new_time": critical.time / factor,
        "limit": critical.limit,
        "value": critical.value,
        "unit": unit,
        "parameters": parameters,
        "message": message,
    }


def _state(problem: ScaleProblem, time: float) -> States:
    x = problem.trajectory.sample(np.array([time]), 2)
    return States(np.array([time]), x[:, 0], x[:, 1], x[:, 2])


def _parameters(problem: ScaleProblem, critical: Critical, factor: float) -> list[dict[str, Any]]:
    """Where the width of the torque range comes from, at the instant that decides."""
    if problem.options.method == "nominal":
        return []
    at = _state(problem, critical.time)
    widths = parameter_widths(problem.robot, at.q, factor * at.dq, factor**2 * at.ddq)
    return [asdict(share) for share in ranked(widths[critical.joint])[:_SHOWN]]


def infeasible(problem: ScaleProblem, critical: Critical | None) -> str:
    """Why no factor of the range is safe, with numbers."""
    low, high = problem.options.min_factor, problem.options.max_factor
    if critical is None:
        return f"no factor from {low:g} to {high:g} is safe"
    name, unit = problem.robot.joints[critical.joint].name, unit_of(problem.robot, critical.joint, critical.quantity)
    where = f"at t = {critical.time:.6g} s of the unscaled motion"
    if critical.quantity != "torque":
        reached = f"{critical.value:.6g} {unit} {where}, its limit is {critical.limit:.6g} {unit}"
        return f"even {low:g} times as fast as planned {name} has a {critical.quantity} of {reached}"
    at = _state(problem, critical.time)
    side = 0 if critical.side == "upper" else 1
    ranges = ranges_by(problem.robot, problem.options.method)(at.q, at.dq, at.ddq)
    held = float(bounds_at(ranges, 0.0)[side, critical.joint, 0]) * (1.0 - 2.0 * side)
    beyond = held > critical.limit if critical.side == "upper" else held < critical.limit
    if not beyond:
        text = f"no factor from {low:g} to {high:g} is safe: at {low:g}, {name} may need {critical.value:.5g} {unit}"
        return f"{text} {where}, its {critical.side} limit is {critical.limit:.5g} {unit}"
    still = np.zeros_like(at.q)
    nominal = float(exact_bounds(without_width(problem.robot), at.q, still, still).nominal[0, critical.joint])
    friction = problem.robot.joints[critical.joint].friction
    dry = float(friction.coulomb.interval.sup) + friction.coulomb_band
    text = (
        f"infeasible at any speed: however slowly the motion is run, {name} may need {held:.5g} {unit} {where}, beyond "
        f"its {critical.side} limit of {critical.limit:.5g} {unit}. Gravity alone asks for {nominal:.5g} {unit} at "
        f"nominal parameters; dry friction adds up to {dry:.4g}"
    )
    slow = low * at.dq  # not at rest: there the widest uncertainty would be the sign of dry friction
    shares = ranked(parameter_widths(problem.robot, at.q, slow, still)[critical.joint])
    if shares and problem.options.method != "nominal":
        text += f". The widest uncertainty is {shares[0].parameter} ({shares[0].width:.3g} {unit})"
    return text + ". A stronger drive, a lighter payload, another posture or better known parameters are needed"
