"""The tables of a robot: extended D-H, link parameters, intervals; as CSV text and JSON data."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_published import published_intervals
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.assembly.link_parameters import LinkIntervals, LinkParameters, link_parameters
from modrob_cli.errors import NumericalError
from modrob_cli.interval import Interval
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.model.body import INERTIA_ENTRIES
from modrob_cli.model.dh import DhTable
from modrob_cli.model.robot import Robot

DH_HEADER = ("joint", "type", "a", "alpha", "d", "theta", "gamma", "p", "n")
LINK_QUANTITIES = ("mass", *(f"com_{x}" for x in "xyz"), *(f"inertia_com_{entry}" for entry in INERTIA_ENTRIES))
EXACT = 1e-9
"""Widths below this [kg, m, kg m^2] are rounding, not uncertainty."""
DRIVE_QUANTITIES = ("viscous", "coulomb", "rotor_inertia")
Json = dict[str, Any]


@dataclass(frozen=True)
class RobotTables:
    """A robot with its views; link quantities are given in the D-H frames."""

    robot: Robot
    dh: DhTable
    links: LinkParameters
    tight: LinkIntervals
    published: LinkIntervals

    @classmethod
    def of(cls, robot: Robot) -> "RobotTables":
        """Compute all tables of a robot.

        Raises
        ------
        NumericalError
            If its numbers are so large that a parameter is not finite.
        """
        with np.errstate(all="ignore"):
            dh = dh_table(robot)
            links = link_parameters(robot, dh.frames)
            values = (dh.a, dh.d, dh.p, dh.n, links.mass, links.com, links.inertia_com)
            if not all(np.isfinite(value).all() for value in values):
                message = "the masses or lengths are too large to compute with; modrob check says where they are"
                raise NumericalError(f"{robot.name}: {message}")
            return cls(robot, dh, links, tight_intervals(robot, dh.frames), published_intervals(robot, dh.frames))

    def dh_rows(self) -> list[tuple[Any, ...]]:
        """Rows of the D-H table in the order of ``DH_HEADER``; d and theta at q = 0."""
        dh = self.dh
        columns = (dh.a, dh.alpha, dh.d, dh.theta, dh.gamma, dh.p, dh.n)
        return [
            (joint.name, joint.type, *(float(column[i]) for column in columns))
            for i, joint in enumerate(self.robot.joints)
        ]

    def dh_csv(self) -> str:
        """D-H table as CSV."""
        return csv_text(DH_HEADER, self.dh_rows())

    def dynpar_csv(self) -> str:
        """Nominal dynamic parameters as CSV, one row per joint and the link it moves."""
        header = ("joint", *LINK_QUANTITIES, *DRIVE_QUANTITIES, "gear_ratio", "torque_constant")
        rows = []
        for i, joint in enumerate(self.robot.joints):
            drive = (joint.drive.gear_ratio, joint.drive.torque_constant)
            rows.append((joint.name, *self._nominal(i), *(value for value, _ in self._drive(i)), *drive))
        return csv_text(header, rows)

    def intervals_csv(self) -> str:
        """Bounds of every parameter as CSV: the tight range and the one by the published recursion."""
        header = ("joint", "quantity", "nominal", "lower", "upper", "published_lower", "published_upper")
        return csv_text(header, self._interval_rows())

    def _nominal(self, i: int) -> list[float]:
        links = self.links
        return [float(links.mass[i]), *map(float, links.com[i]), *map(float, links.inertia_com[i])]

    def _drive(self, i: int) -> list[tuple[float, Interval]]:
        joint = self.robot.joints[i]
        parts = (joint.friction.viscous, joint.friction.coulomb, joint.drive.rotor_inertia)
        return [(float(part.nominal), part.interval) for part in parts]

    def _interval_rows(self) -> Iterator[tuple[Any, ...]]:
        for i, joint in enumerate(self.robot.joints):
            tight, published = _flat(self.tight, i), _flat(self.published, i)
            for k, quantity in enumerate(LINK_QUANTITIES):
                yield (joint.name, quantity, self._nominal(i)[k], *tight[k], *published[k])
            for quantity, (nominal, interval) in zip(DRIVE_QUANTITIES, self._drive(i), strict=True):
                ends = (float(interval.inf), float(interval.sup))
                yield (joint.name, quantity, nominal, *ends, *ends)

    def widening(self) -> float | None:
        """Median over all parameters with a width of published width / tight width; None if all are exact."""
        tight = np.concatenate([self.tight.mass.wid[:, None], self.tight.com.wid, self.tight.inertia_com.wid], axis=1)
        wide = [self.published.mass.wid[:, None], self.published.com.wid, self.published.inertia_com.wid]
        published = np.concatenate(wide, axis=1)
        open_ = (tight > EXACT) & np.isfinite(published)
        return float(np.median(published[open_] / tight[open_])) if open_.any() else None

    def widths(self, i: int) -> list[tuple[float, float]]:
        """Widest (tight, published) widths of link i: mass, centre of mass, inertia; 0 where exact to rounding."""
        pairs = []
        for quantity in ("mass", "com", "inertia_com"):
            tight = np.atleast_1d(getattr(self.tight, quantity)[i].wid)
            published = np.atleast_1d(getattr(self.published, quantity)[i].wid)
            k = int(tight.argmax())
            pairs.append((float(tight[k]) if tight[k] > EXACT else 0.0, float(published[k])))
        return pairs

    def to_json(self) -> Json:
        """The result of ``modrob assemble`` for one robot, without its files."""
        joints = self.robot.joints
        return {
            "name": self.robot.name,
            "dof": self.robot.dof,
            "dh": [dict(zip(DH_HEADER, row, strict=True)) for row in self.dh_rows()],
            "links": [self._link_json(i) for i in range(self.robot.dof)],
            "intervals": [self._interval_json(self.tight, i) for i in range(self.robot.dof)],
            "intervals_published": [self._interval_json(self.published, i) for i in range(self.robot.dof)],
            "base_transform": self.dh.base_transform.tolist(),
            "tool_transform": self.dh.tool_transform.tolist(),
            "gravity": self.robot.gravity.tolist(),
            "joints": [joint.name for joint in joints],
        }

    def _link_json(self, i: int) -> Json:
        joint, links = self.robot.joints[i], self.links
        return {
            "joint": joint.name,
            "mass": float(links.mass[i]),
            "com": links.com[i].tolist(),
            "inertia_com": links.inertia_com[i].tolist(),
            **{name: value for name, (value, _) in zip(DRIVE_QUANTITIES, self._drive(i), strict=True)},
            "gear_ratio": joint.drive.gear_ratio,
            "torque_constant": joint.drive.torque_constant,
        }

    def _interval_json(self, links: LinkIntervals, i: int) -> Json:
        ends = _flat(links, i)
        drive = zip(DRIVE_QUANTITIES, self._drive(i), strict=True)
        return {
            "mass": list(ends[0]),
            "com": [list(pair) for pair in ends[1:4]],
            "inertia_com": [list(pair) for pair in ends[4:]],
            **{name: [float(interval.inf), float(interval.sup)] for name, (_, interval) in drive},
        }


def _flat(links: LinkIntervals, i: int) -> list[tuple[float | None, float | None]]:
    """Ends of the ten parameters of one link; None stands for unbounded."""
    parts = [links.mass[i : i + 1], links.com[i], links.inertia_com[i]]
    ends = [(float(low), float(high)) for part in parts for low, high in zip(part.inf, part.sup, strict=True)]
    return [(low if math.isfinite(low) else None, high if math.isfinite(high) else None) for low, high in ends]
