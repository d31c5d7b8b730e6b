"""``trajectory/1``: a planned motion as a function of time."""

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from modrob_cli.arrays import Array
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import Curve, SineCurve, sine_product
from modrob_cli.model.trajectory_pieces import quintic_spline, rest_to_rest, sin2_profiles
from modrob_cli.schema.base import Angle, Document, Name
from modrob_cli.schema.trajectory_parts import FactorSpec, JointSinesSpec, PointSpec, point_faults

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
_SHOWN = 10

Positive = Annotated[float, Field(gt=0.0)]
PositiveAngle = Annotated[Angle, Field(gt=0.0)]


class TrajectoryDocument(Document):
    """A motion of all joints, base to tip, from t = 0 on. Which keys it has depends on its kind."""

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
        faults = point_faults(str(kind), points)
        if faults:
            more = f"; and {len(faults) - _SHOWN} more faults" if len(faults) > _SHOWN else ""
            message = "Input should have points that fit together: {faults}"
            raise PydanticCustomError("points", message, {"faults": "; ".join(faults[:_SHOWN]) + more})
        return points

    @model_validator(mode="after")
    def _fits_kind(self) -> Self:
        required = _REQUIRED[self.kind]
        given = {key for key in self.model_fields_set if getattr(self, key) is not None} - _COMMON
        missing = [key for key in required if key not in given]
        wrong = sorted(given - {*required, *_OPTIONAL.get(self.kind, ())})
        parts = [f"lacks {', '.join(missing)}"] if missing else []
        parts += [f"has {', '.join(wrong)}, which this kind does not know"] if wrong else []
        if parts:
            message = "Input should have {keys} for kind {kind}; it {parts}"
            values = {"keys": " and ".join(required), "kind": self.kind, "parts": " and ".join(parts)}
            raise PydanticCustomError("kind", message, values)
        for faults in (self._joint_faults(), self._sin2_faults()):
            if faults:
                raise PydanticCustomError("joints", "Input should fit together: {faults}", {"faults": faults})
        return self

    def _joint_faults(self) -> str:
        product = self.kind == "sine-products"
        out = []
        for k, joint in enumerate(self.joints or (), start=1):
            if product != (joint.amplitude is not None):
                out.append(f"joint {k} {'lacks' if product else 'has'} amplitude (kind {self.kind})")
            if product and (joint.terms or joint.sin or joint.cos):
                out.append(f"joint {k} has terms, sin or cos, which belong to kind sines")
            if (joint.sin or joint.cos) and not product and self.base_frequency is None:
                out.append(f"joint {k} has sin or cos, which need base_frequency")
        if not out and self.joints:
            with np.errstate(all="ignore"):  # absurd sizes become infinite, which is refused here
                periods = max(curve.periods for curve in self._sine_curves())
            if not periods <= MOST_PERIODS:
                out.append(f"the motion has {periods:.3g} periods, at most {MOST_PERIODS:.0e} are possible")
        return "; ".join(out)

    def _sin2_faults(self) -> str:
        dof = len(self.points[0].q) if self.points else 0
        pairs = (("velocity", self.velocity), ("acceleration", self.acceleration))
        return "; ".join(
            f"{key} has {len(values)} values, the points have {dof}"
            for key, values in pairs
            if values and len(values) != dof
        )

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
