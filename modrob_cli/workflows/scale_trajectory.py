"""The scaled motion as a file: the same kind of document where that is exact, else samples."""

from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.io.documents import read_document
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.schema import TrajectoryDocument
from modrob_cli.workflows.scale_problem import acceleration_jumps
from modrob_cli.workflows.trajectory_motion import LoadedTrajectory

MOST_POINTS = 5000
"""A motion through more points is written as samples."""
_LONGEST_NAME = 57


def scaled_motion(loaded: LoadedTrajectory, c: float, rate: float) -> tuple[str, str]:
    """File name and text of a motion that is run c times as fast.

    A ``trajectory/1`` document stays one of its kind, with times divided by c, velocities and frequencies times c,
    accelerations times c^2: exact but for the rounding of these numbers. A motion through points whose acceleration is
    continuous becomes a spline document. Others (jumps of acceleration; very many points) become CSV samples.

    Parameters
    ----------
    rate : samples per second of the new motion, where it becomes samples
    """
    name = f"{loaded.name[:_LONGEST_NAME]}-scaled"
    if loaded.kind in ("waypoints", "spline", "sin2", "sines", "sine-products"):
        document, _ = read_document(loaded.path, TrajectoryDocument)
        data = _scaled_document(document.model_dump(mode="python", exclude_unset=True), c)
        return f"{name}.yaml", yaml_text({**data, "name": name, "description": _described(data, c)})
    spline = _as_spline(loaded.trajectory, c)
    if spline is not None:
        head = {"modrob": "trajectory/1", "name": name, "kind": "spline"}
        return f"{name}.yaml", yaml_text({**head, "description": f"run {c!r} times as fast", "points": spline})
    return f"{name}.csv", _samples(loaded.trajectory, c, rate)


def _described(data: dict[str, Any], c: float) -> str:
    told = f"run {c!r} times as fast"
    return f"{data['description']} ({told})" if data.get("description") else told


def _scaled_document(data: dict[str, Any], c: float) -> dict[str, Any]:
    """Every time divided by c, and what is per time times c for each."""
    powers = {"duration": -1, "base_frequency": 1, "velocity": 1, "acceleration": 2}
    out = {key: _times(value, c ** powers[key]) if key in powers else value for key, value in data.items()}
    inner = {"t": -1, "dwell": -1, "dq": 1, "ddq": 2, "frequency": 1}
    for key in ("points", "factors"):
        if out.get(key) is not None:
            out[key] = [
                {k: _times(v, c ** inner[k]) if k in inner else v for k, v in part.items()} for part in out[key]
            ]
    if out.get("joints") is not None:
        out["joints"] = [_scaled_joint(joint, c) for joint in out["joints"]]
    return out


def _scaled_joint(joint: dict[str, Any], c: float) -> dict[str, Any]:
    terms = joint.get("terms")
    if not terms:
        return joint
    return {**joint, "terms": [{**term, "frequency": _times(term["frequency"], c)} for term in terms]}


def _times(value: Any, factor: float) -> Any:
    if value is None:
        return None
    return [factor * item for item in value] if isinstance(value, list) else factor * value


def _as_spline(trajectory: Trajectory, c: float) -> list[dict[str, Any]] | None:
    """Points of the quintic spline that is the scaled motion; None if there is none or it has very many."""
    knots = trajectory.curves[0].knots
    if len(knots) > MOST_POINTS or any(not np.array_equal(curve.knots, knots) for curve in trajectory.curves):
        return None
    if any(acceleration_jumps(curve).any() for curve in trajectory.curves):
        return None
    x = trajectory.sample(knots, 2)
    return [
        {"t": t / c, "q": q.tolist(), "dq": (c * dq).tolist(), "ddq": (c * c * ddq).tolist()}
        for t, (q, dq, ddq) in zip(knots.tolist(), x, strict=True)
    ]


def _samples(trajectory: Trajectory, c: float, rate: float) -> str:
    t = np.linspace(0.0, trajectory.duration, max(int(np.ceil(trajectory.duration / c * rate)), 1) + 1)
    x: Array = trajectory.sample(t, 2)
    header = ["t", *(f"{kind}{j}" for kind in ("q", "dq", "ddq") for j in range(1, trajectory.dof + 1))]
    return csv_text(header, np.column_stack([t / c, x[:, 0], c * x[:, 1], c * c * x[:, 2]]).tolist())
