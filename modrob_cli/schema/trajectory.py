"""``trajectory/1``: a planned motion as a function of time."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, ValidationInfo, field_validator, model_validator

from modrob_cli.arrays import Array
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import Curve, SineCurve, sine_product
from modrob_cli.model.trajectory_pieces import quintic_spline, rest_to_rest, sin2_profiles
from modrob_cli.schema.base import Angle, Document, Name
from modrob_cli.schema.located import LocatedFault, raise_faults
from modrob_cli.schema.trajectory_parts import FactorSpec, JointSinesSpec, PointSpec, joint_faults, point_faults

MOST_PERIODS = 1e5
"""More periods than any motion has; keeps the search for extremes finite."""

_REQUIRED = {
    "waypoints": ("order", "points"),
    "spline": ("points",),
    "sin2": ("points", "velocity", "acceleration"),
    "sines": ("duration", "joints"),
    "sine-products": ("duration", "joints", "factors"),
}
_OPTIONAL = {"sines": ("base_frequency",)}
_COMMON = {"modrob", "name", "kind", "source", "description"}


def _kind_rules() -> list[Any]:
    """JSON Schema of the keys that each kind needs, and of those that it does not know."""
    special = sorted({key for keys in (*_REQUIRED.values(), *_OPTIONAL.values()) for key in keys})
    rules = []
    for kind, required in _REQUIRED.items():
        others = [key for key in special if key not in (*required, *_OPTIONAL.get(kind, ()))]
        then = {"required": list(required), "properties": {key: {"type": "null"} for key in others}}
        rules.append({"if": {"properties": {"kind": {"const": kind}}, "required": ["kind"]}, "then": then})
    return rules


Positive = Annotated[float, Field(gt=0.0)]
PositiveAngle = Annotated[Angle, Field(gt=0.0)]


class TrajectoryDocument(Document):
    """A motion of all joints, base to tip, from t = 0 on. Which keys it has depends on its kind."""

    model_config = ConfigDict(json_schema_extra={"allOf": _kind_rules()})

    modrob: Literal["trajectory/1"]
    name: Name
    kind: Literal["waypoints", "spline", "sin2", "sines", "sine-products"]
    source: str = Field(default="", description="where the motion comes from")
    description: str = ""
    order: Literal[5, 7] | None = Field(default=None, description="waypoints: of the rest-to-rest polynomials")
    duration: Positive | None = Field(default=None, description="sines, sine-products: [s]")
    base_frequency: PositiveAngle | None = Field(default=None, description="sines: of the Fourier series [rad/s]")
    velocity: list[PositiveAngle] | None = Field(default=None, description="sin2: largest, for each joint [rad/s]")
    acceleration: list[PositiveAngle] | None = Field(
        default=None, description="sin2: largest, for each joint [rad/s^2]"
    )
    factors: list[FactorSpec] | None = Field(
        default=None, min_length=1, max_length=8, description="sine-products: sines whose product every joint follows"
    )
    points: list[PointSpec] | None = Field(
        default=None, min_length=2, description="waypoints, spline, sin2: where the motion goes through"
    )
    joints: list[JointSinesSpec] | None = Field(
        default=None, min_length=1, description="sines, sine-products: motion of each joint"
    )

    @field_validator("points")
    @classmethod
    def _points_fit(cls, points: list[PointSpec] | None, info: ValidationInfo) -> list[PointSpec] | None:
        kind = info.data.get("kind")
        if points is None or "points" not in _REQUIRED.get(str(kind), ()):
            return points
        raise_faults("points", point_faults(str(kind), points))
        return points

    @model_validator(mode="after")
    def _fits_kind(self) -> Self:
        required = _REQUIRED[self.kind]
        given = {key for key in self.model_fields_set if getattr(self, key) is not None} - _COMMON
        missing = [key for key in required if key not in given]
        wrong = sorted(given - {*required, *_OPTIONAL.get(self.kind, ())})
        keys = " and ".join(required)
        faults = [LocatedFault((), f"Input should have {keys} for kind {self.kind}; it lacks {', '.join(missing)}", {})]
        faults = faults if missing else []
        for key in wrong:
            message = f"Input should be nothing here: kind {self.kind} has {keys}, but no {key}"
            faults.append(LocatedFault((key,), message, getattr(self, key)))
        raise_faults("kind", faults)
        raise_faults("parts", [*self._joint_faults(), *self._sin2_faults()])
        return self

    def _joint_faults(self) -> Iterator[LocatedFault]:
        faults = list(joint_faults(self.kind, self.joints or (), self.base_frequency))
        for fault in faults:
            yield replace(fault, place=("joints", *fault.place))
        if not faults and self.joints:
            with np.errstate(all="ignore"):  # absurd sizes become infinite, which is refused here
                periods = max(curve.periods for curve in self._sine_curves())
            if not periods <= MOST_PERIODS:
                message = f"Input should have at most {MOST_PERIODS:.0e} periods in its duration, not {periods:.3g}"
                yield LocatedFault(("joints",), message, self.joints)

    def _sin2_faults(self) -> Iterator[LocatedFault]:
        dof = len(self.points[0].q) if self.points else 0
        for key, values in (("velocity", self.velocity), ("acceleration", self.acceleration)):
            if values and len(values) != dof:
                yield LocatedFault((key,), f"Input should have as many values as q of the points: {dof}", values)

    def to_model(self) -> Trajectory:
        """Return the motion."""
        return Trajectory(self.name, self._curves())

    def _sine_curves(self) -> tuple[SineCurve, ...]:
        if self.kind == "sines":
            base = self.base_frequency or 0.0
            return tuple(joint.to_sum(self.duration or math.nan, base) for joint in self.joints or ())
        return tuple(self._product(joint) for joint in self.joints or ())

    def _curves(self) -> tuple[Curve, ...]:
        if self.joints is not None:
            return self._sine_curves()
        points = self.points or []
        if self.kind == "sin2":
            q = np.array([point.q for point in points], dtype=float)
            limits: list[Any] = [np.array(self.velocity), np.array(self.acceleration)]
            return sin2_profiles(q, [point.dwell or 0.0 for point in points], *limits)[1]
        return tuple(self._through(points, j) for j in range(len(points[0].q)))

    def _product(self, joint: JointSinesSpec) -> SineCurve:
        factors = self.factors or []
        frequency, phase = (np.array([getattr(factor, key) for factor in factors]) for key in ("frequency", "phase"))
        return sine_product(self.duration or math.nan, joint.offset, joint.amplitude or 0.0, frequency, phase)

    def _through(self, points: list[PointSpec], j: int) -> Curve:
        """Curve of joint j through those points that it has."""
        own = [point for point in points if point.q[j] is not None]
        t, q = np.array([point.t for point in own], dtype=float), np.array([point.q[j] for point in own], dtype=float)
        if self.kind == "waypoints":
            return rest_to_rest(t, q, 5 if self.order == 5 else 7)

        def of(key: str) -> Array:
            return np.array([0.0 if (values := getattr(point, key)) is None else values[j] for point in own])

        return quintic_spline(t, q, of("dq"), of("ddq"))
