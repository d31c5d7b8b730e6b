"""Bounds of quantities with a tolerance, against exact rationals; angles against mpmath."""

import math
from fractions import Fraction
from typing import Any

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from modrob_cli.schema.base import PoseSpec
from modrob_cli.schema.body import BodySpec
from modrob_cli.schema.quantity import InertiaSpec, ScalarSpec

nominals = st.one_of(st.sampled_from([0.0, -0.0, 1.0, 3.9, -0.1, 5e-324, 1e-310]), st.floats(-1e300, 1e300))


def check_bounds(spec: ScalarSpec, low: Fraction, high: Fraction) -> None:
    """The bounds hold the exact ones, and no narrower doubles do."""
    found = spec.bounds
    assert Fraction(found[0]) <= low <= high <= Fraction(found[1])
    assert low < Fraction(math.nextafter(found[0], math.inf))
    assert Fraction(math.nextafter(found[1], -math.inf)) < high


@settings(max_examples=500, deadline=None)
@given(nominal=nominals, percent=st.decimals(0, 200, places=3, allow_nan=False))
def test_percentage_is_exact_and_rounded_outward(nominal: float, percent: Any) -> None:
    spec = ScalarSpec.model_validate({"nominal": nominal, "tol": f"{percent:f}%"})
    half = abs(Fraction(nominal)) * Fraction(f"{percent:f}") / 100
    check_bounds(spec, Fraction(nominal) - half, Fraction(nominal) + half)


@settings(max_examples=500, deadline=None)
@given(nominal=nominals, tol=st.floats(0, 1e300))
def test_absolute_tolerance_is_exact_and_rounded_outward(nominal: float, tol: float) -> None:
    spec = ScalarSpec.model_validate({"nominal": nominal, "tol": tol})
    check_bounds(spec, Fraction(nominal) - Fraction(tol), Fraction(nominal) + Fraction(tol))


@settings(max_examples=200, deadline=None)
@given(values=st.tuples(nominals, nominals, nominals))
def test_min_and_max_are_taken_as_they_are(values: tuple[float, float, float]) -> None:
    low, nominal, high = sorted(values)
    assert ScalarSpec(nominal=nominal, min=low, max=high).bounds == (low, high)


@pytest.mark.parametrize(
    "value",
    [
        {"nominal": 1e308, "tol": 1e308},
        {"nominal": 1.7976931348623157e308, "tol": 1e290},
        {"nominal": 1.0, "tol": -0.1},
        {"nominal": 1.0, "tol": math.nan},
        {"nominal": 1.0, "tol": math.inf},
        {"nominal": 1.0, "tol": True},
        {"nominal": 1.0, "tol": "-5%"},
        {"nominal": 1.0, "tol": "5"},
        {"nominal": 1.0, "tol": "5 percent"},
        {"nominal": 1.0, "tol": "\u0665%"},
        {"nominal": 1.0, "tol": "9" * 400 + "%"},
        {"nominal": 1.0, "tol": 0.1, "min": 0.0, "max": 2.0},
        {"nominal": 1.0, "min": 0.0},
        {"nominal": 1.0, "min": 2.0, "max": 0.0},
        {"nominal": 1.0, "min": 2.0, "max": 3.0},
        {"nominal": math.nan},
        {"nominal": "1"},
        {"nominal": True},
        {},
    ],
)
def test_what_is_no_quantity_is_refused(value: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        ScalarSpec.model_validate(value)


@pytest.mark.parametrize(
    "com",
    [
        {"nominal": [1, 2, 3], "min": {}},
        {"nominal": [1, 2, 3], "tol": [1, 2]},
        {"nominal": {"xx": 1}},
        {"nominal": 1},
        [1, 2],
        "x",
        {"tol": 1},
        [{"nominal": 1e308, "tol": 1e308}, 0, 0],
    ],
)
def test_what_is_no_vector_is_refused(com: Any) -> None:
    with pytest.raises(ValidationError):
        BodySpec.model_validate({"mass": 1.0, "com": com})


@pytest.mark.parametrize(
    "inertia",
    [
        [[1, 2, 3], [0, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, 1, 0]],
        [1, 2, 3],
        {"nominal": 1},
        {"nominal": {"xx": 1}, "tol": {"yy": 1}},
        {"nominal": {"xx": 1}, "min": []},
        {"xx": -1},
        {"xx": {"nominal": 1, "tol": 2}},
    ],
)
def test_what_is_no_tensor_is_refused(inertia: Any) -> None:
    with pytest.raises(ValidationError):
        BodySpec.model_validate({"mass": 1.0, "inertia": inertia})


def test_forms_of_one_body_agree() -> None:
    rows = [[3.0, 0.1, 0.2], [0.1, 4.0, 0.3], [0.2, 0.3, 5.0]]
    named = {"xx": 3.0, "xy": 0.1, "xz": 0.2, "yy": 4.0, "yz": 0.3, "zz": 5.0}
    spread = {key: {"nominal": value, "tol": "5%"} for key, value in named.items()}
    both = [{"nominal": rows, "tol": "5%"}, {"nominal": named, "tol": "5%"}, spread]
    models = [BodySpec.model_validate({"mass": 1.0, "inertia": form}).to_model("b") for form in both]
    for model in models:
        assert model.inertia.nominal.tolist() == [3.0, 0.1, 0.2, 4.0, 0.3, 5.0]
        assert (model.inertia.interval.inf == models[0].inertia.interval.inf).all()
        assert (model.inertia.interval.sup == models[0].inertia.interval.sup).all()
    vectors = [{"nominal": [1.0, -2.0, 0.0], "tol": 0.5}, [{"nominal": x, "tol": 0.5} for x in (1.0, -2.0, 0.0)]]
    for form in vectors:
        com = BodySpec.model_validate({"mass": 1.0, "com": form}).to_model("b").com.interval
        assert (com.inf.tolist(), com.sup.tolist()) == ([0.5, -2.5, -0.5], [1.5, -1.5, 0.5])
    assert InertiaSpec().to_model().is_exact


@pytest.mark.parametrize(
    ("text", "factor"),
    [("pi", 1), ("-pi/2", "-1/2"), ("3*pi/4", "3/4"), ("-3 pi / 4", "-3/4"), ("0.25pi", "1/4"), ("180 deg", 1),
     ("-90deg", "-1/2"), ("1e2 deg", "5/9"), (".5 deg", "1/360"), ("30 deg/2", "1/12")],
)  # fmt: skip
def test_angles(text: str, factor: Any) -> None:
    found = PoseSpec.model_validate({"rpy": [text, 0, 0]}).rpy[0]
    with mpmath.workdps(40):
        exact = mpmath.mpf(Fraction(factor).numerator) / Fraction(factor).denominator * mpmath.pi
        # pi rounded, one product and one quotient: at most two units in the last place
        assert abs(found - exact) <= 2 * math.ulp(float(exact))


@pytest.mark.parametrize("text", ["", "pi/0", "deg", "1", "1,5 deg", "--pi", "pi pi", "1e deg", "nan deg", "\u0661 deg",
                                  "1" * 100 + " deg", "1e999 deg", "90 degrees", "0x1 rad", "pi/-2"])  # fmt: skip
def test_what_is_no_angle_is_refused(text: str) -> None:
    with pytest.raises(ValidationError):
        PoseSpec.model_validate({"rpy": [text, 0, 0]})
