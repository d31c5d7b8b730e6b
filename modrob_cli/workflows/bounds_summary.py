"""Figures of torque bounds over a motion: what tables, JSON and the picture say."""

from dataclasses import asdict
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.dynamics.width_share import WidthShare
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.model.motion import Excess
from modrob_cli.model.robot import Robot
from modrob_cli.plot.bounds import BoundsLabels
from modrob_cli.workflows.bounds_method import BoundsOptions

_UNITS = {"position": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}


def unit(robot: Robot, i: int) -> str:
    """Unit of the torque of a joint."""
    return "N m" if robot.joints[i].type == "revolute" else "N"


class Summary:
    """Figures of each joint, of a motion that comes in pieces."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.samples = 0
        self.span = [np.inf, -np.inf]
        self._total, self._widest, self._beyond = (np.zeros(robot.dof) for _ in range(3))
        self._lowest, self._highest = np.full(robot.dof, np.inf), np.full(robot.dof, -np.inf)
        limits = [joint.limits.torque or (-np.inf, np.inf) for joint in robot.joints]
        self._limits = np.array(limits).T

    def add(self, t: Array, found: TorqueBounds) -> None:
        """Take the next samples."""
        width = found.upper - found.lower
        self.samples += len(t)
        self.span = [min(self.span[0], float(t[0])), max(self.span[1], float(t[-1]))]
        self._total += width.sum(axis=0)
        self._widest = np.maximum(self._widest, width.max(axis=0))
        self._lowest = np.minimum(self._lowest, found.lower.min(axis=0))
        self._highest = np.maximum(self._highest, found.upper.max(axis=0))
        self._beyond += ((found.lower < self._limits[0]) | (found.upper > self._limits[1])).sum(axis=0)

    def to_json(self, options: BoundsOptions) -> dict[str, Any]:
        """Figures as plain data."""
        joints = [
            {
                "name": joint.name,
                "unit": unit(self.robot, i),
                "mean_width": float(self._total[i]) / self.samples,
                "max_width": float(self._widest[i]),
                "min_lower": float(self._lowest[i]),
                "max_upper": float(self._highest[i]),
                "torque_limits": list(joint.limits.torque) if joint.limits.torque else None,
                "samples_beyond_limits": int(self._beyond[i]),
            }
            for i, joint in enumerate(self.robot.joints)
        ]
        head = {"robot": self.robot.name, "joints": joints, "method": options.method, "samples": self.samples}
        return {**head, "start": self.span[0], "end": self.span[1], "options": asdict(options)}

    def labels(self, motion: str, options: BoundsOptions) -> BoundsLabels:
        """Words of the picture."""
        figures = self.to_json(options)
        method = "exact range" if options.method == "exact" else "published interval algorithm (IANEA*)"
        given = (("ddq", options.ddq_tolerance), ("q", options.q_noise), ("dq", options.dq_noise))
        more = [f"{name} +- {', '.join(f'{value:g}' for value in values)}" for name, values in given if values]
        subtitle = "; ".join([f"{method} over all admissible parameters", *more, f"{self.samples} samples"])
        return BoundsLabels(
            f"{self.robot.name}: torque bounds along {motion}",
            subtitle,
            self.robot.joint_names,
            tuple(joint["unit"] for joint in figures["joints"]),
            tuple(_width_note(joint) for joint in figures["joints"]),
            tuple(_limit_note(joint, self.samples) for joint in figures["joints"]),
            tuple(joint.limits.torque for joint in self.robot.joints),
        )


def _width_note(joint: dict[str, Any]) -> str:
    return f"width: mean {joint['mean_width']:.3g}, max {joint['max_width']:.3g} {joint['unit']}"


def _limit_note(joint: dict[str, Any], samples: int) -> str:
    limits, beyond = joint["torque_limits"], joint["samples_beyond_limits"]
    if not limits:
        return ""
    text = f"limits {limits[0]:.3g} .. {limits[1]:.3g} {joint['unit']}"
    return f"{text}, beyond in {100.0 * beyond / samples:.2g} % of the samples" if beyond else text


def share_json(robot: Robot, i: int, ranking: list[WidthShare]) -> dict[str, Any]:
    """Shares of one joint as plain data."""
    parameters = [asdict(share) for share in ranking]
    return {"name": robot.joints[i].name, "unit": unit(robot, i), "parameters": parameters}


def shares_csv(robot: Robot, ranking: list[list[WidthShare]]) -> str:
    """Shares as a table, joint by joint, largest first."""
    header = ("joint", "rank", "parameter", "share", "mean_width", "unit")
    rows = [
        (joint.name, k, share.parameter, share.share, share.width, unit(robot, i))
        for i, joint in enumerate(robot.joints)
        for k, share in enumerate(ranking[i], start=1)
    ]
    return csv_text(header, rows)


def warning_json(robot: Robot, excess: Excess, samples: int) -> dict[str, Any]:
    """A warning as plain data, with a sentence for people."""
    revolute = robot.joints[robot.joint_names.index(excess.joint)].type == "revolute"
    name = _UNITS[excess.quantity] if revolute else _UNITS[excess.quantity].replace("rad", "m")
    low, high = excess.limit
    what = f"{excess.joint}: {excess.quantity} outside {low:.5g} .. {high:.5g} {name}"
    first = f"in {excess.count} of {samples} samples, first at t = {excess.first_time:.6g} s"
    worst = f"worst at t = {excess.worst_time:.6g} s: {excess.worst:.3g} {name} outside"
    message = f"{what} {first}; {worst}"
    return {**asdict(excess), "limit": list(excess.limit), "unit": name, "message": message}
