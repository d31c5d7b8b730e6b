"""Parts of ``trajectory/1`` documents: points, sines, factors."""

from collections.abc import Iterator, Sequence

import numpy as np
from pydantic import Field

from modrob_cli.model.trajectory_curves import SineCurve
from modrob_cli.schema.base import Angle, Document
from modrob_cli.schema.located import LocatedFault


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


def point_faults(kind: str, points: Sequence[PointSpec]) -> Iterator[LocatedFault]:
    """Everything that is wrong with points of one kind."""
    dof = len(points[0].q)
    for k, point in enumerate(points):
        for key in ("t", "dq", "ddq", "dwell"):
            if getattr(point, key) is not None and key not in KEYS[kind]:
                yield LocatedFault(
                    (k, key), f"Input should be nothing here: kind {kind} knows no {key}", getattr(point, key)
                )
        if "t" in KEYS[kind] and point.t is None:
            yield LocatedFault((k,), "Input should have a time t", {})
        for key in ("q", "dq", "ddq"):
            values = getattr(point, key)
            if values is not None and len(values) != dof:
                message = f"Input should have as many values as q of the first point: {dof}"
                yield LocatedFault((k, key), message, values)
        yield from _gap_faults(kind, k, point, kind != "waypoints" or k in (0, len(points) - 1))
    yield from _time_faults(points) if "t" in KEYS[kind] else _way_faults(points)


def _gap_faults(kind: str, k: int, point: PointSpec, is_forbidden: bool) -> Iterator[LocatedFault]:
    for j, value in enumerate(point.q):
        if value is None and is_forbidden:
            where = "the first and the last point" if kind == "waypoints" else f"points of kind {kind}"
            yield LocatedFault((k, "q", j), f"Input should be a position: {where} have no gaps", None)


def _time_faults(points: Sequence[PointSpec]) -> Iterator[LocatedFault]:
    times = [point.t for point in points]
    if times[0] is not None and times[0] != 0.0:
        yield LocatedFault((0, "t"), "Input should be 0, where motions begin", times[0])
    for k in range(1, len(times)):
        before, now = times[k - 1], times[k]
        if before is not None and now is not None and not now > before:
            message = f"Input should be more than the {before:.9g} of the point before: times increase"
            yield LocatedFault((k, "t"), message, now)


def _way_faults(points: Sequence[PointSpec]) -> Iterator[LocatedFault]:
    for k in range(1, len(points)):
        if points[k].q == points[k - 1].q:
            message = "Input should differ from the point before; give that one a dwell instead"
            yield LocatedFault((k, "q"), message, points[k].q)


def joint_faults(kind: str, joints: Sequence[JointSinesSpec], base_frequency: float | None) -> Iterator[LocatedFault]:
    """Keys of joints that do not go with the kind of sines, or are missing."""
    product = kind == "sine-products"
    for k, joint in enumerate(joints):
        if product and joint.amplitude is None:
            yield LocatedFault((k,), f"Input should have an amplitude for kind {kind}", {})
        if not product and joint.amplitude is not None:
            message = f"Input should be nothing here: kind {kind} has amplitudes in terms, sin and cos"
            yield LocatedFault((k, "amplitude"), message, joint.amplitude)
        for key in ("terms", "sin", "cos"):
            values = getattr(joint, key)
            if product and values:
                yield LocatedFault((k, key), "Input should be nothing here: it belongs to kind sines", values)
            if not product and values and key != "terms" and base_frequency is None:
                yield LocatedFault((k, key), "Input should have a base_frequency in the document", values)
