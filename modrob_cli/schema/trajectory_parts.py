"""Parts of ``trajectory/1`` documents: points, sines, factors."""

from collections.abc import Iterator, Sequence

import numpy as np
from pydantic import Field

from modrob_cli.model.trajectory_curves import SineCurve
from modrob_cli.schema.base import Angle, Document


class PointSpec(Document):
    """A point that the motion goes through."""

    t: float | None = Field(default=None, ge=0.0, description="time [s]; the first is 0; not for kind sin2")
    q: list[Angle | None] = Field(
        min_length=1, description="positions [rad] or [m]; kind waypoints: null where the joint has no point"
    )
    dq: list[float] | None = Field(default=None, description="kind spline: velocities, 0 where left out")
    ddq: list[float] | None = Field(default=None, description="kind spline: accelerations, 0 where left out")
    dwell: float | None = Field(default=None, ge=0.0, description="kind sin2: rest here [s]")


class FactorSpec(Document):
    """A sine sin(frequency t + phase)."""

    frequency: Angle = Field(description="[rad/s]")
    phase: Angle = 0.0


class TermSpec(FactorSpec):
    """A sine with an amplitude."""

    amplitude: Angle = Field(description="[rad] or [m]")


class JointSinesSpec(Document):
    """Motion of one joint of the kinds sines and sine-products."""

    offset: Angle = Field(default=0.0, description="[rad] or [m]")
    amplitude: Angle | None = Field(default=None, description="kind sine-products: of the product [rad] or [m]")
    terms: list[TermSpec] = Field(default=[], description="kind sines: summands")
    sin: list[Angle] = Field(default=[], description="kind sines: of sin(k base_frequency t), k = 1, 2, ... [rad]")
    cos: list[Angle] = Field(default=[], description="kind sines: of cos(k base_frequency t), k = 1, 2, ... [rad]")

    def to_sum(self, duration: float, base_frequency: float) -> SineCurve:
        """Return the sum of the terms and of the Fourier series."""
        series = [(a, k * base_frequency, 0.0) for k, a in enumerate(self.sin, start=1)]
        series += [(a, k * base_frequency, 0.5 * np.pi) for k, a in enumerate(self.cos, start=1)]
        series += [(term.amplitude, term.frequency, term.phase) for term in self.terms]
        amplitude, frequency, phase = np.array(series, dtype=float).reshape(-1, 3).T
        return SineCurve(duration, self.offset, amplitude, frequency, phase)


KEYS = {
    "waypoints": ("t", "q"),
    "spline": ("t", "q", "dq", "ddq"),
    "sin2": ("q", "dwell"),
}
"""Keys of points by the kind of the trajectory."""


def point_faults(kind: str, points: Sequence[PointSpec]) -> list[str]:
    """Everything that is wrong with points of one kind, in words."""
    out = []
    dof = len(points[0].q)
    for k, point in enumerate(points, start=1):
        given = [key for key in ("t", "dq", "ddq", "dwell") if getattr(point, key) is not None]
        wrong = [key for key in given if key not in KEYS[kind]]
        if wrong:
            out.append(f"point {k} has {' and '.join(wrong)}, which kind {kind} does not know")
        if "t" in KEYS[kind] and point.t is None:
            out.append(f"point {k} has no t")
        for key in ("q", "dq", "ddq"):
            values = getattr(point, key)
            if values is not None and len(values) != dof:
                out.append(f"point {k} has {len(values)} values of {key}, the first point has {dof} of q")
        if None in point.q and (kind != "waypoints" or k in (1, len(points))):
            where = "the first and the last point" if kind == "waypoints" else f"points of kind {kind}"
            out.append(f"point {k} has a gap, {where} need a position for every joint")
    out += _time_faults(points) if "t" in KEYS[kind] else _way_faults(points)
    return out


def _time_faults(points: Sequence[PointSpec]) -> Iterator[str]:
    times = [point.t for point in points]
    if times[0] is not None and times[0] != 0.0:
        yield f"point 1 has t = {times[0]:.9g}, the first time must be 0"
    for k in range(1, len(times)):
        before, now = times[k - 1], times[k]
        if before is not None and now is not None and not now > before:
            yield f"point {k + 1} has t = {now:.9g} after {before:.9g}, times must increase"


def _way_faults(points: Sequence[PointSpec]) -> Iterator[str]:
    for k in range(1, len(points)):
        if points[k].q == points[k - 1].q:
            yield f"point {k + 1} is the same as the one before, give that one a dwell instead"
