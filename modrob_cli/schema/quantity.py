"""Quantities with uncertainty: ``3.9``, ``{nominal: 3.9, min: 3.7, max: 4.1}``, ``{nominal: 3.9, tol: 5%}``."""

import math
import re
from fractions import Fraction
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from modrob_cli.interval import Interval
from modrob_cli.model.body import INERTIA_ENTRIES
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.schema.base import Document

_LONGEST_PERCENTAGE = 40
_PERCENT = re.compile(r"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*%\s*\Z", re.ASCII)


def _parse_tolerance(value: Any) -> Any:
    """Keep numbers; turn ``5%`` into a Fraction of the nominal value, with its sign as the mark."""
    if isinstance(value, str):
        match = _PERCENT.match(value) if len(value) <= _LONGEST_PERCENTAGE else None
        if match is None:
            raise PydanticCustomError("tol", "Input should be a number >= 0 or a percentage such as '5%'")
        return Percent(Fraction(match[1]) / 100)
    return value


class Percent(float):
    """A tolerance relative to the nominal value; keeps the exact fraction."""

    exact: Fraction

    def __new__(cls, fraction: Fraction) -> "Percent":
        """Make the float and remember the fraction."""
        self = super().__new__(cls, float(fraction))
        self.exact = fraction
        return self


def _check_tolerance(value: Any) -> float:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value < 0:
        raise PydanticCustomError("tol", "Input should be a finite number >= 0 or a percentage such as '5%'")
    return value if isinstance(value, Percent) else float(value)


Tolerance = Annotated[
    Any,
    BeforeValidator(_parse_tolerance, json_schema_input_type=float | str),
    AfterValidator(_check_tolerance),
]


def _outward(value: Fraction, toward: float) -> float:
    """Nearest double on the far side of an exact value."""
    try:
        nearest = float(value)
    except OverflowError:
        return toward
    inside = Fraction(nearest) > value if toward < 0 else Fraction(nearest) < value
    return math.nextafter(nearest, toward) if inside else nearest


class ScalarSpec(Document):
    """One uncertain number. Bounds from ``tol`` are rounded outward."""

    nominal: float
    min: float | None = None
    max: float | None = None
    tol: Tolerance | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        both = (self.min is None) == (self.max is None)
        if not both or (self.tol is not None and self.min is not None):
            raise PydanticCustomError("uncertain", "Input should have either both min and max, or tol, or neither")
        if self.min is not None and self.max is not None:
            if self.min > self.max:
                raise PydanticCustomError(
                    "order", "Input should have min <= max, min is {low} and max is {high}",
                    {"low": self.min, "high": self.max},
                )  # fmt: skip
            if not self.min <= self.nominal <= self.max:
                raise PydanticCustomError(
                    "nominal", "Input should have nominal {value} inside [min, max] = [{low}, {high}]",
                    {"value": self.nominal, "low": self.min, "high": self.max},
                )  # fmt: skip
        if not all(math.isfinite(bound) for bound in self.bounds):
            raise PydanticCustomError("tol", "Input should give finite bounds")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Lower and upper bound."""
        if self.min is not None and self.max is not None:
            return self.min, self.max
        if self.tol is None or self.nominal == 0.0 and isinstance(self.tol, Percent):
            return self.nominal, self.nominal
        nominal = Fraction(self.nominal)
        half = abs(nominal) * self.tol.exact if isinstance(self.tol, Percent) else Fraction(self.tol)
        return _outward(nominal - half, -math.inf), _outward(nominal + half, math.inf)

    def to_model(self) -> Uncertain:
        """Return nominal value and interval, shape ()."""
        return Uncertain(np.asarray(self.nominal), Interval(*self.bounds))


def _lift_scalar(value: Any) -> Any:
    """Accept a plain number where an uncertain one is expected."""
    return value if isinstance(value, dict | ScalarSpec) else {"nominal": value}


Scalar = Annotated[ScalarSpec, BeforeValidator(_lift_scalar, json_schema_input_type=float | ScalarSpec)]


def _non_negative(spec: ScalarSpec) -> ScalarSpec:
    if spec.bounds[0] < 0.0:
        raise PydanticCustomError(
            "negative", "Input should be >= 0 over its whole interval, it goes down to {low}", {"low": spec.bounds[0]}
        )
    return spec


NonNegative = Annotated[Scalar, AfterValidator(_non_negative)]


def _spread(value: dict[str, Any], keys: tuple[Any, ...], pick: Any) -> dict[Any, Any]:
    """Turn {nominal: many, tol: one or many, ...} into one uncertain scalar per key."""
    out: dict[Any, Any] = {}
    for key in keys:
        parts = {}
        for name, content in value.items():
            parts[name] = pick(content, key) if isinstance(content, list | dict) else content
        out[key] = parts
    return out


def _lift_vector(value: Any) -> Any:
    """Accept {nominal: [x, y, z], tol: 5%} where a list of three uncertain numbers is expected."""
    if not (isinstance(value, dict) and "nominal" in value):
        return value
    many = [part for part in value.values() if isinstance(part, list | dict)]
    fits = all(isinstance(part, list) and len(part) == 3 for part in many)
    if not (fits and isinstance(value["nominal"], list)):
        raise PydanticCustomError("vector", "Input should have lists of three numbers as nominal, min, max and tol")
    return list(_spread(value, (0, 1, 2), lambda content, key: content[key]).values())


Vector = Annotated[
    list[Scalar],
    Field(min_length=3, max_length=3),
    BeforeValidator(_lift_vector, json_schema_input_type=list[Scalar] | dict[str, Any]),
    Field(description="three numbers, each a number or {nominal, min, max} or {nominal, tol}"),
]


def vector_to_model(parts: list[ScalarSpec]) -> Uncertain:
    """Join three uncertain numbers into a vector, shape (3,)."""
    return Uncertain.stack([part.to_model() for part in parts])


class InertiaSpec(Document):
    """A symmetric tensor, entry by entry."""

    xx: NonNegative = ScalarSpec(nominal=0.0)
    yy: NonNegative = ScalarSpec(nominal=0.0)
    zz: NonNegative = ScalarSpec(nominal=0.0)
    xy: Scalar = ScalarSpec(nominal=0.0)
    xz: Scalar = ScalarSpec(nominal=0.0)
    yz: Scalar = ScalarSpec(nominal=0.0)

    def to_model(self) -> Uncertain:
        """Return the entries xx, xy, xz, yy, yz, zz, shape (6,)."""
        return Uncertain.stack([getattr(self, entry).to_model() for entry in INERTIA_ENTRIES])


def _from_matrix(value: Any) -> Any:
    """Turn a symmetric 3 x 3 list into named entries."""
    if not isinstance(value, list):
        return value
    if len(value) != 3 or any(not isinstance(row, list) or len(row) != 3 for row in value):
        raise PydanticCustomError("tensor", "Input should be a 3 x 3 list or a mapping xx, yy, zz, xy, xz, yz")
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if value[i][j] != value[j][i]:
            raise PydanticCustomError("tensor", "Input should be a symmetric 3 x 3 list")
    return {entry: value["xyz".index(entry[0])]["xyz".index(entry[1])] for entry in INERTIA_ENTRIES}


def _lift_inertia(value: Any) -> Any:
    """Accept a 3 x 3 list, named entries, or {nominal: either, tol: 5%}."""
    if isinstance(value, dict) and "nominal" in value:
        parts = {name: _from_matrix(content) for name, content in value.items()}
        if not isinstance(parts["nominal"], dict):
            raise PydanticCustomError("tensor", "Input should have a tensor as nominal")
        keys = tuple(parts["nominal"])
        lists = [part for part in parts.values() if isinstance(part, dict)]
        if any(set(part) != set(keys) for part in lists):
            raise PydanticCustomError("tensor", "Input should give the same entries in nominal, min, max and tol")
        return _spread(parts, keys, lambda content, key: content[key])
    return _from_matrix(value)


Inertia = Annotated[
    InertiaSpec,
    BeforeValidator(_lift_inertia, json_schema_input_type=InertiaSpec | list[list[float]] | dict[str, Any]),
    Field(description="tensor: xx, yy, zz, xy, xz, yz or a 3 x 3 list [kg m^2]"),
]
