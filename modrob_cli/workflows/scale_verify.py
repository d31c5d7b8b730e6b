"""Check a certificate of a scaled motion: nothing in it is believed that can be computed from the input files."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.certificate import digest, read_certificate
from modrob_cli.io.outputs import provenance
from modrob_cli.model.trajectory_extremes import QUANTITIES, extremes
from modrob_cli.scaling.cell_torques import CellTorques
from modrob_cli.scaling.certify import chunks, kept, speed_ends
from modrob_cli.scaling.curve_cells import Cells, all_knots
from modrob_cli.scaling.feasible import free_factors, limit_rows
from modrob_cli.scaling.sampled import BEYOND, common
from modrob_cli.scaling.speed_limits import enclosed_factor
from modrob_cli.workflows.scale_certificate import STATEMENT, limit_data
from modrob_cli.workflows.scale_problem import ScaleOptions, ScaleProblem, read_problem

SAME = 1e-9
"""Recorded and recomputed numbers may differ by this, relative to the size of the joint's torques or of the number:
other processors and libraries round otherwise."""
DRAWN = 500
"""Instants at which the bounds of the cells are compared with exact torque ranges, which are computed another way."""
_SEED = 5


@dataclass(frozen=True)
class Verification:
    """Outcome.

    Attributes
    ----------
    faults : what is wrong; nothing if the certificate is true
    factor, cells : of the certificate
    margin : smallest distance of a recomputed bound to its limit, relative to the limit; None without torque limits
    """

    path: Path
    robot: str
    trajectory: str
    factor: float
    cells: int
    margin: float | None
    faults: tuple[str, ...]

    @property
    def data(self) -> dict[str, Any]:
        """As plain data."""
        head = {"certificate": str(self.path), "robot": self.robot, "trajectory": self.trajectory}
        found = {"factor": self.factor, "cells": self.cells, "margin": self.margin}
        return {"verified": not self.faults, **head, **found, "faults": list(self.faults)}


def verify(
    path: Path,
    robot_path: Path | None = None,
    motion_path: Path | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Verification:
    """Check a certificate against the files that it is about.

    Parameters
    ----------
    robot_path, motion_path : where these files are now; as the certificate says, where left out

    Raises
    ------
    InputFileError
        If the certificate is none, or a file that it is about cannot be used.
    """
    content = read_certificate(path)
    robot_path = robot_path or path.parent / content["robot"]
    motion_path = motion_path or path.parent / content["trajectory"]
    problem = read_problem(robot_path, motion_path, _options(path, content), content["topic"])
    faults = list(_faults_of_inputs(content, problem))
    edges = np.array(content["cells"]["edges"])
    wrong = _edge_faults(edges, problem)
    margin = None
    if not wrong and len(content["joints"]) == problem.robot.dof:
        wrong, margin = _bound_faults(content, problem, Cells(edges[:-1], edges[1:]), progress)
    faults += [*wrong, *_sampled_faults(content, problem)]
    if content["digest"] != digest(content):
        faults.append("the content does not match its digest: it was changed after it was written")
    names = (problem.robot.name, problem.loaded.name)
    return Verification(path, *names, content["factor"], len(edges) - 1, margin, tuple(faults))


def _options(path: Path, content: dict[str, Any]) -> ScaleOptions:
    try:
        data = dict(content["options"])
        limits = tuple(
            (name, tuple(None if item is None else (float(item[0]), float(item[1])) for item in ranges))
            for name, ranges in data.pop("limits").items()
        )
        options = ScaleOptions(**data, limits=limits)
        options.check()
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputFileError(
            Fault(str(path), f"options: found something that modrob does not know ({error})")
        ) from error
    return options


def _faults_of_inputs(content: dict[str, Any], problem: ScaleProblem) -> Iterator[str]:
    """Other files, other limits, another motion than those that the certificate is about."""
    now: Any = provenance(problem.files)["inputs"]
    then = content["inputs"]
    changed = [name for name in now if then.get(name) not in (None, now[name])]
    if changed:
        yield f"changed since the certificate was written: {', '.join(changed)}"
    if sorted(now.values()) != sorted(map(str, then.values())) and not changed:
        yield "the certificate is about other files than those that were read"
    if content["statement"] != STATEMENT:
        yield "the statement is not the one that modrob proves"
    if content["joints"] != list(problem.robot.joint_names) or content["limits"] != limit_data(problem):
        yield "joints or limits are not those of the robot and the options"
    if content["duration"] != problem.trajectory.duration:
        yield f"the duration is {problem.trajectory.duration!r} s, not {content['duration']!r} s"


def _edge_faults(edges: Array, problem: ScaleProblem) -> list[str]:
    """Cells that do not cover the motion, or reach over the end of a piece."""
    if not (np.diff(edges) > 0.0).all():
        return ["the edges of the cells do not increase"]
    if edges[0] != 0.0 or edges[-1] != problem.trajectory.duration:
        return ["the cells do not cover the whole motion"]
    if not np.isin(all_knots(problem.trajectory), edges).all():
        return ["a cell reaches over the end of a piece of the motion"]
    return []


def _bound_faults(
    content: dict[str, Any], problem: ScaleProblem, cells: Cells, progress: Callable[[float], None]
) -> tuple[list[str], float | None]:
    """Compute all bounds again, compare them with the limits, with the record, and with exact ranges."""
    c, limits = content["factor"], problem.limits
    lower: list[Array] = []
    upper: list[Array] = []
    speeds = []
    proven = [(part[0], part[1]) for part in content["proven"]]
    if not proven or any(a > b for a, b in proven) or proven[-1][1] != c:
        return ["the proven factors are no intervals that end with the factor"], None
    faults = []
    free = list(proven)
    done = 0
    for part in chunks(cells):
        torques = CellTorques(problem.robot, problem.trajectory, part)
        for own, found in zip((lower, upper), torques.bounds(c), strict=True):
            own.append(found)
        speeds.append(speed_ends(torques))
        rows = limit_rows(torques, *limits)
        if len(rows.side):
            free = common(free, free_factors(torques, rows, proven[0][0], c))
        done += part.count
        progress(done / cells.count)
    low, high = np.concatenate(lower, axis=1), np.concatenate(upper, axis=1)
    slow, fast = (np.concatenate([pair[k] for pair in speeds], axis=-1) for k in range(2))
    if not kept(low, high, limits) or enclosed_factor(problem.robot, slow, fast)[0] < c:
        faults.append(f"the cells do not prove the factor {c!r}: a bound is beyond its limit")
    if sum(b - a for a, b in proven) - sum(b - a for a, b in free) > 10.0 * SAME * c:
        faults.append("not all factors that the certificate calls proven are")
    size = np.maximum(np.abs(low), np.abs(high)).max(axis=1)
    recorded = [np.array(content["cells"][key]).T for key in ("lower", "upper")]
    if any((np.abs(a - b) > SAME * size[:, None]).any() for a, b in zip(recorded, (low, high), strict=True)):
        faults.append("recorded bounds are not those that the cells have")
    found = np.stack([slow.min(axis=-1), fast.max(axis=-1)])
    record = np.array([content["speed"]["lower"], content["speed"]["upper"]])
    if (np.abs(found - record) > SAME * np.abs(found).max(axis=(0, 2))[:, None]).any():
        faults.append("recorded velocities, accelerations or jerks are not those of the motion")
    return [*faults, *_drawn_faults(problem, cells, c, recorded)], _margin(low, high, limits)


def _margin(low: Array, high: Array, limits: tuple[Array, Array]) -> float | None:
    rooms = [(limits[1] - high.max(axis=1)) / np.abs(limits[1]), (low.min(axis=1) - limits[0]) / np.abs(limits[0])]
    known = [float(room) for pair in rooms for room in pair if np.isfinite(room)]
    return min(known, default=None)


def _drawn_faults(problem: ScaleProblem, cells: Cells, c: float, recorded: list[Array]) -> list[str]:
    """Compare recorded bounds with exact ranges at drawn instants, which are computed in another way."""
    rng = np.random.default_rng(_SEED)
    k = rng.integers(cells.count, size=DRAWN)
    t = np.clip(cells.start[k] + rng.random(DRAWN) * (cells.end - cells.start)[k], cells.start[k], cells.end[k])
    inside = (t > cells.start[k]) & (t < cells.end[k])
    k, x = k[inside], problem.trajectory.sample(t[inside], 2)
    exact = exact_bounds(problem.robot, x[:, 0], c * x[:, 1], c * c * x[:, 2])
    slack = SAME * np.abs(recorded).max()  # the ranges at instants have rounding margins of their own
    wrong = (exact.lower < recorded[0].T[k] - slack) | (exact.upper > recorded[1].T[k] + slack)
    return ["a torque range at an instant is wider than the recorded bounds of its cell"] if wrong.any() else []


def _sampled_faults(content: dict[str, Any], problem: ScaleProblem) -> Iterator[str]:
    """The factor at the samples: at the recorded instant it keeps the limit that decides, and no more."""
    factor, critical = content["sampled_factor"], content["critical"]
    if not content["factor"] <= factor <= problem.options.max_factor:
        yield "the factor at the samples is below the proven one, or beyond the largest that was asked for"
    if critical is None:
        if factor != problem.options.max_factor:
            yield "nothing decides, but the factor at the samples is not the largest that was asked for"
        return
    try:
        good = _decides(critical, factor, problem)
    except (KeyError, TypeError, ValueError, IndexError, ArithmeticError):
        good = False
    if not good:
        yield "what is said to decide does not decide at the factor of the samples"


def _decides(critical: dict[str, Any], factor: float, problem: ScaleProblem) -> bool:
    """True if the limit is kept at the factor and broken by a little more."""
    j, upper, time = critical["joint"], critical["side"] == "upper", critical["time"]
    if not isinstance(j, int) or not 0 <= j < problem.robot.dof or critical["side"] not in ("upper", "lower"):
        return False
    if not 0.0 <= time <= problem.trajectory.duration:
        return False
    if critical["quantity"] != "torque":
        order = QUANTITIES.index(critical["quantity"])
        found = extremes(problem.trajectory.curves[j], order)
        value, at = (found.high, found.high_time) if upper else (found.low, found.low_time)
        limit = getattr(problem.robot.joints[j].limits, critical["quantity"])[int(upper)]
        there = abs(at - time) <= SAME * problem.trajectory.duration
        return bool(there and abs(value * factor**order - limit) <= SAME * abs(limit))
    sides = []  # a jump at the instant has two
    for before in (False, True):
        curves, t = problem.trajectory.curves, np.array([time])
        sides.append(np.stack([[curve.derivative(t, k, before)[0] for curve in curves] for k in range(3)]))
    q, dq, ddq = np.stack(sides, axis=1)
    factors = np.repeat([factor, factor * (1.0 + 2.0 * BEYOND)], 2)[:, None]
    q, dq, ddq = (np.tile(part, (2, 1)) for part in (q, dq, ddq))
    bounds = exact_bounds(problem.robot, q, factors * dq, factors**2 * ddq)
    beyond = bounds.upper[:, j] > problem.high[j] if upper else bounds.lower[:, j] < problem.low[j]
    return bool(not beyond[:2].any() and beyond[2:].any())
