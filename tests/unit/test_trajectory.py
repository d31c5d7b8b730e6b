"""Planned motions: derivatives, points that are met, continuity, extremes."""

from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.errors import InputFileError, NumericalError, ShapeError
from modrob_cli.io.documents import read_document
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import PiecewiseCurve, SineCurve, sine_product
from modrob_cli.model.trajectory_extremes import extremes, violations
from modrob_cli.model.trajectory_pieces import quintic_spline, rest_to_rest, sin2_profiles
from modrob_cli.schema import TrajectoryDocument
from modrob_cli.workflows.robots import load_robot

SHIPPED = sorted(shipped_folder("trajectories").glob("*.yaml"))


def load(path: Path) -> tuple[TrajectoryDocument, Trajectory]:
    document, _ = read_document(path, TrajectoryDocument)
    return document, document.to_model()


def knots_of(trajectory: Trajectory) -> Array:
    return np.unique(np.concatenate([curve.knots for curve in trajectory.curves]))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_each_derivative_is_that_of_the_one_below(path: Path) -> None:
    """Central differences of the order below, of all shipped motions, away from the points where a piece ends."""
    document, trajectory = load(path)
    assert document.name == path.stem
    h = 1e-4
    rng = np.random.default_rng(7)
    t = rng.uniform(h, trajectory.duration - h, 400)
    t = t[np.abs(t[:, None] - knots_of(trajectory)).min(axis=1) > h]
    assert len(t) > 300
    values = trajectory.sample(t)
    above, below = trajectory.sample(t + h), trajectory.sample(t - h)
    for k in range(4):
        slope = (above[:, k] - below[:, k]) / (2.0 * h)
        scale = np.abs(values[:, k + 1]).max()
        # Truncation h^2/6 |third derivative|: the pieces last at least 0.5 s, so about (h / 0.1)^2; rounding 1e-16 / h.
        np.testing.assert_allclose(values[:, k + 1], slope, rtol=0, atol=1e-5 * scale)


@pytest.mark.parametrize("path", [path for path in SHIPPED if path.stem.startswith("table")], ids=lambda p: p.stem)
def test_tables_are_met_at_rest(path: Path) -> None:
    document, trajectory = load(path)
    assert document.points
    zero = 3 if document.order == 5 else 4
    for point in document.points:
        values = trajectory.sample(np.asarray(point.t, dtype=float))
        for j, wanted in enumerate(point.q):
            if wanted is not None:
                assert abs(values[0, j] - wanted) <= 1e-12
                # The just-before side is asked for in the continuity test; here the arm rests.
                np.testing.assert_allclose(values[1:zero, j], 0.0, atol=1e-12)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_motions_go_on_smoothly_where_pieces_meet(path: Path) -> None:
    document, trajectory = load(path)
    smooth = {"spline": 2, "sin2": 3}.get(document.kind, 2 if document.order == 5 else 3)
    for curve in trajectory.curves:
        inner = curve.knots[1:-1]
        for k in range(smooth + 1):
            before, after = curve.derivative(inner, k, before=True), curve.derivative(inner, k)
            # Rounding of the sum of coefficients up to about 100, divided by (0.5 s)^k.
            np.testing.assert_allclose(before, after, rtol=0, atol=1e-13 * 10.0 ** (k + 1))


def test_the_next_derivative_jumps() -> None:
    """The continuity test would see a jump: 5th order has a jump of jerk 60 q / T^3 at rest, closed form."""
    curve = rest_to_rest(np.array([0.0, 2.0, 3.0]), np.array([0.0, 1.0, 1.0]), 5)
    assert curve.derivative(np.array([2.0]), 3, before=True)[0] == pytest.approx(60.0 / 8.0, rel=1e-13)
    assert curve.derivative(np.array([2.0]), 3)[0] == 0.0


@pytest.mark.parametrize(("order", "peaks"), [(5, (1.875, 5.7735026919)), (7, (2.1875, 7.5131884043))])
def test_peaks_of_rest_to_rest_polynomials(order: Any, peaks: tuple[float, float]) -> None:
    """Textbook peaks of velocity and acceleration, and when, for a unit move in a unit time."""
    curve = rest_to_rest(np.array([0.0, 1.0]), np.array([0.0, 1.0]), order)
    for k, peak in enumerate(peaks, start=1):
        assert extremes(curve, k).high == pytest.approx(peak, rel=1e-10)
    assert extremes(curve, 1).high_time == pytest.approx(0.5, abs=1e-15)
    middle = 0.5 / 3**0.5 if order == 5 else 0.1 * 5**0.5
    assert extremes(curve, 2).high_time == pytest.approx(0.5 - middle, abs=1e-14)


def test_quintic_spline_meets_position_velocity_acceleration() -> None:
    rng = np.random.default_rng(3)
    t = np.cumsum(np.concatenate([[0.0], rng.uniform(0.2, 3.0, 9)]))
    q, dq, ddq = rng.normal(size=(3, 10))
    curve = quintic_spline(t, q, dq, ddq)
    for k, wanted in enumerate((q, dq, ddq)):
        for before in (False, True):
            # Coefficients up to about 100, divided by (0.2 s)^2.
            np.testing.assert_allclose(curve.derivative(t, k, before), wanted, rtol=0, atol=1e-12 * 10.0**k)


@pytest.mark.parametrize("factors", [1, 2, 3])
def test_sine_product_against_mpmath(factors: int) -> None:
    w, phi = np.array([0.63, 1.57, 2.9])[:factors], np.array([0.1, 0.0, -0.7])[:factors]
    curve = sine_product(8.0, 0.2, -0.7, w, phi)

    def exact(t: Any) -> Any:
        return 0.2 - 0.7 * mpmath.fprod(
            mpmath.sin(mpmath.mpf(a) * t + mpmath.mpf(b)) for a, b in zip(w, phi, strict=True)
        )

    times = np.linspace(0.1, 7.9, 9)
    with mpmath.workdps(40):
        for k in range(5):
            wanted = [float(mpmath.diff(exact, mpmath.mpf(t), k)) for t in times]
            # Angles up to 40 rad, frequencies up to 5.1 rad/s: rounding 40 * 2^-53 * 5.1^k.
            np.testing.assert_allclose(curve.derivative(times, k), wanted, rtol=0, atol=1e-14 * 5.1**k)


def test_sin2_profile_has_the_acceleration_it_is_named_after() -> None:
    """A pulse A sin^2(pi t / T) with T = 2 V / A, then constant V, for the joint that sets the pace."""
    q = np.array([[0.0, 0.0], [3.0, -1.0]])
    arrivals, (first, second) = sin2_profiles(q, [0.0, 0.0], np.array([1.5, 1.5]), np.array([3.0, 3.0]))
    t = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(first.derivative(t, 2), 3.0 * np.sin(np.pi * t) ** 2, atol=1e-13)
    np.testing.assert_allclose(second.derivative(t, 2), -(np.sin(np.pi * t) ** 2), atol=1e-13)
    assert arrivals[1] == pytest.approx(3.0 / 1.5 + 1.0)
    assert extremes(first, 1).high == pytest.approx(1.5, rel=1e-13)
    assert extremes(first, 0).high == pytest.approx(3.0, abs=1e-12)
    short, _ = sin2_profiles(np.array([[0.0], [0.01]]), [0.0, 0.0], np.array([1.5]), np.array([3.0]))
    # Two pulses of duration T: the way is A T^2 / 2.
    assert short[1] == pytest.approx(2.0 * np.sqrt(2.0 * 0.01 / 3.0))
    with pytest.raises(ShapeError, match="equal"):
        sin2_profiles(np.zeros((2, 1)), [0.0, 0.0], np.ones(1), np.ones(1))


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_extremes_against_dense_sampling(order: int) -> None:
    rng = np.random.default_rng(order)
    curve = SineCurve(40.0, 0.3, rng.normal(size=5), rng.uniform(0.1, 6.0, 5), rng.uniform(0.0, 6.0, 5))
    t = np.linspace(0.0, 40.0, 2_000_001)
    values = curve.derivative(t, order)
    found = extremes(curve, order)
    # Between samples 2e-5 s apart a curve of frequency 6 rad/s rises by at most (2e-5 * 6)^2 / 8 of its size.
    size = 1e-8 * np.abs(values).max()
    assert values.max() <= found.high <= values.max() + size
    assert values.min() - size <= found.low <= values.min()
    assert curve.derivative(np.array([found.high_time]), order)[0] == found.high
    assert found.high_time == pytest.approx(t[values.argmax()], abs=2e-4)


def test_extremes_see_both_sides_of_a_jump() -> None:
    """Jerk of a 5th-order move: 60 q / T^3 at both ends, -30 q / T^3 in the middle."""
    curve = rest_to_rest(np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 0.0]), 5)
    found = extremes(curve, 3)
    assert found.high == pytest.approx(60.0)
    assert found.high_time == 0.0
    assert found.low == pytest.approx(-30.0)
    last = rest_to_rest(np.array([0.0, 2.0, 3.0]), np.array([0.0, 0.0, -1.0]), 5)
    assert extremes(last, 3).low == pytest.approx(-60.0)
    # Jerk 120 s - 240 s^2 before the middle point, 180 - 720 s + 600 s^2 after it, worked out by hand.
    still = np.zeros(3)
    spline = quintic_spline(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 1.0]), still, np.array([0.0, -20.0, 0.0]))
    found = extremes(spline, 3)
    assert [found.low, found.high] == pytest.approx([-120.0, 180.0])
    assert (found.low_time, found.high_time) == (1.0, 1.0)


@pytest.mark.parametrize(("below", "count"), [(1e-12, 0), (1e-6, 2)])
def test_a_limit_may_be_touched_up_to_rounding(workspace: Path, below: float, count: int) -> None:
    path = workspace / "planar.yaml"
    limits = f"limits: {{velocity: {1.875 * (1 - below)!r}}}"
    path.write_text(path.read_text().replace("dh: {a: 0.4}", f"dh: {{a: 0.4}}, {limits}"))
    move = rest_to_rest(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]), 5)
    assert len(violations(Trajectory("x", (move, move)), load_robot(path).robot)) == count


def test_violations_have_joint_quantity_value_and_time(workspace: Path) -> None:
    path = workspace / "planar.yaml"
    limits = "limits: {position: 1, velocity: 2, acceleration: 5, jerk: 100}"
    path.write_text(path.read_text().replace("dh: {a: 0.4}", f"dh: {{a: 0.4}}, {limits}"))
    robot = load_robot(path).robot
    move = rest_to_rest(np.array([0.0, 1.0]), np.array([0.0, 1.0]), 5)
    found = violations(Trajectory("x", (move, move)), robot)
    # Position and velocity (peak 1.875) are inside; the acceleration peaks are +-10/sqrt(3) at (1 -+ 1/sqrt(3)) / 2.
    assert [(v.joint, v.quantity, v.limit) for v in found] == [(1, "acceleration", (-5.0, 5.0))] * 2
    assert [v.value for v in found] == pytest.approx([-10.0 / 3**0.5, 10.0 / 3**0.5])
    assert [v.time for v in found] == pytest.approx([0.5 + 0.5 / 3**0.5, 0.5 - 0.5 / 3**0.5])
    assert found[0].excess == pytest.approx(10.0 / 3**0.5 - 5.0)
    with pytest.raises(ShapeError):
        violations(Trajectory("x", (move,)), robot)


def test_samples_have_the_shape_of_the_times() -> None:
    move = rest_to_rest(np.array([0.0, 2.0]), np.array([0.0, 1.0]), 7)
    trajectory = Trajectory("x", (move, move, move))
    assert (trajectory.dof, trajectory.duration) == (3, 2.0)
    assert trajectory.sample(0.5).shape == (5, 3)
    assert trajectory.sample(np.zeros((4, 6)), 2).shape == (4, 6, 3, 3)
    with pytest.raises(NumericalError, match="outside"):
        trajectory.sample(2.1)
    with pytest.raises(NumericalError, match="outside"):
        trajectory.sample([0.0, np.nan])
    pytest.raises(ShapeError, trajectory.sample, 0.0, 5)


def test_curves_that_do_not_fit() -> None:
    with pytest.raises(ShapeError, match="increase"):
        PiecewiseCurve(np.array([0.0, 1.0, 1.0]), np.zeros((2, 1)), np.zeros(2))
    with pytest.raises(ShapeError, match="duration"):
        SineCurve(0.0, 0.0, np.ones(1), np.ones(1), np.ones(1))
    one, two = (SineCurve(t, 0.0, np.ones(1), np.ones(1), np.ones(1)) for t in (1.0, 2.0))
    with pytest.raises(ShapeError, match="same duration"):
        Trajectory("x", (one, two))
    pytest.raises(ShapeError, Trajectory, "x", ())


HEAD = "modrob: trajectory/1\nname: x\n"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("kind: waypoints\norder: 5\npoints: [{t: 0, q: [0]}]", ["at least 2"]),
        ("kind: waypoints\norder: 6\npoints: [{t: 0, q: [0]}, {t: 1, q: [0]}]", ["$.order", "5 or 7"]),
        ("kind: waypoints\npoints: [{t: 0, q: [0]}, {t: 1, q: [0]}]", ["lacks order"]),
        (
            "kind: waypoints\norder: 7\npoints:\n- {t: 1, q: [0]}\n- {t: 1, q: [~, 1], dq: [0]}\n- {q: [~]}",
            [
                "x.yaml:6:4: $.points[0].t: found 1.0, expected 0, where motions begin",
                "x.yaml:7:4: $.points[1].t: found 1.0, expected more than the 1 of the point before",
                "x.yaml:7:10: $.points[1].q: found a list of 2, expected as many values as q of the first point: 1",
                "x.yaml:7:21: $.points[1].dq: found a list of 1, expected nothing here: kind waypoints knows no dq",
                "x.yaml:8:3: $.points[2]: found a mapping, expected a time t",
                "x.yaml:8:8: $.points[2].q[0]: found nothing, expected a position: the first and the last",
            ],
        ),
        ("kind: spline\npoints: [{t: 0, q: [0]}, {t: 1, q: [~]}]", ["$.points[1].q[0]", "kind spline have no gaps"]),
        (
            "kind: spline\npoints: [{t: 0, q: [0], ddq: [0, 0]}, {t: 1, q: [0]}]",
            ["$.points[0].ddq: found a list of 2, expected as many values"],
        ),
        (
            "kind: spline\norder: 5\npoints: [{t: 0, q: [0]}, {t: 1, q: [1]}]",
            ["x.yaml:4:1: $.order: found 5, expected nothing here: kind spline has points, but no order"],
        ),
        ("kind: sines\njoints: [{}]", ["lacks duration"]),
        ("kind: sines\nduration: 0\njoints: [{}]", ["$.duration", "greater than 0"]),
        (
            "kind: sines\nduration: 1\njoints: [{cos: [1]}, {amplitude: 1}]",
            ["$.joints[0].cos: found a list of 1, expected a base_frequency", "$.joints[1].amplitude: found 1.0, "],
        ),
        (
            "kind: sines\nduration: 1e6\njoints: [{terms: [{amplitude: 1, frequency: 1e6}]}]",
            ["at most 1e+05 periods in its duration, not 1.59e+11"],
        ),
        (
            "kind: sine-products\nduration: 1\nfactors: [{frequency: 1}]\njoints: [{}]",
            ["$.joints[0]: found a mapping, expected an amplitude"],
        ),
        (
            "kind: sine-products\nduration: 1\nfactors: [{frequency: 1}]\njoints: [{amplitude: 1, sin: [1]}]",
            ["$.joints[0].sin: found a list of 1, expected nothing here: it belongs to kind sines"],
        ),
        (
            "kind: sin2\npoints: [{q: [0]}, {q: [0]}]\nvelocity: [1, 1]\nacceleration: [1]",
            ["$.points[1].q: found a list of 1, expected it to differ from the point before"],
        ),
        (
            "kind: sin2\npoints: [{q: [0]}, {q: [1]}]\nvelocity: [1, 1]\nacceleration: [1, 1]",
            ["$.velocity: found a list of 2, expected as many values as q", "$.acceleration: found a list of 2"],
        ),
        ("kind: sin2\npoints: [{q: [0]}, {q: [1]}]\nvelocity: [0]\nacceleration: [1]", ["$.velocity[0]", "greater"]),
        ("kind: circle", ["$.kind"]),
    ],
)  # fmt: skip
def test_faults_of_documents(tmp_path: Path, text: str, wanted: list[str]) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(HEAD + text)
    with pytest.raises(InputFileError) as caught:
        read_document(path, TrajectoryDocument)
    for part in wanted:
        assert part in str(caught.value)


def test_sines_and_fourier_series(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    terms = "joints: [{offset: 10 deg, terms: [{amplitude: 0.5, frequency: 3, phase: pi/4}], sin: [1, 2], cos: [0, 4]}]"
    path.write_text(f"{HEAD}kind: sines\nduration: 3\nbase_frequency: pi/2\n{terms}\n")
    trajectory = load(path)[1]
    t = np.linspace(0.0, 3.0, 31)
    w = np.pi / 2
    wanted = np.radians(10.0) + 0.5 * np.sin(3.0 * t + np.pi / 4)
    wanted += np.sin(w * t) + 2.0 * np.sin(2.0 * w * t) + 4.0 * np.cos(2.0 * w * t)
    np.testing.assert_allclose(trajectory.sample(t)[:, 0, 0], wanted, atol=1e-13)
