"""Interval parameters of links: tight ranges against sampling, vertices and rational arithmetic."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.interval_published import published_intervals
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.assembly.link_parameters import LinkIntervals
from modrob_cli.interval import Interval
from modrob_cli.model.body import InertiaPoint, PlacedBody, RigidBody, tensor, tensor_entries
from modrob_cli.model.joint import Joint
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import from_xyz_rpy, parallel_axis

EYE = np.eye(4)


def uncertain(low: Array, high: Array) -> Uncertain:
    return Uncertain(0.5 * (np.asarray(low) + high), Interval(low, high))


def random_bodies(rng: np.random.Generator, count: int, about: InertiaPoint, aligned: bool) -> list[PlacedBody]:
    bodies = []
    for k in range(count):
        rpy = rng.choice([0.0, np.pi / 2, np.pi], 3) if aligned else rng.uniform(-3.0, 3.0, 3)
        mass, com = rng.uniform(0.1, 3.0), rng.uniform(-0.1, 0.1, 3)
        tol, spread = rng.uniform(0.0, 0.3), rng.uniform(0.0, 0.03, 3)
        inertia = np.array([0.02, 0.001, 0.0, 0.03, -0.002, 0.025])
        width = 0.05 * np.abs(inertia)
        parts = (
            uncertain(np.asarray(mass * (1 - tol)), np.asarray(mass * (1 + tol))),
            uncertain(com - spread, com + spread),
            uncertain(inertia - width, inertia + width),
        )
        bodies.append(PlacedBody(1, from_xyz_rpy(rng.uniform(-0.3, 0.3, 3), rpy), RigidBody(f"b{k}", *parts, about)))
    return bodies


def one_link(bodies: list[PlacedBody]) -> Robot:
    joint = Joint("q1", "revolute", EYE)
    return Robot("one", (joint,), tuple(bodies), EYE, np.array([0.0, 0.0, -9.81]), Interval(np.zeros(1)))


def flat(intervals: LinkIntervals) -> tuple[Array, Array]:
    parts = (intervals.mass[:, None][0], intervals.com[0], intervals.inertia_com[0])
    return np.concatenate([part.inf for part in parts]), np.concatenate([part.sup for part in parts])


def compose(bodies: list[PlacedBody], mass: Array, com: Array, inertia: Array) -> Array:
    """Mass, centre of mass, central inertia by the textbook formulas, for samples (K, B), (K, B, 3), (K, B, 6)."""
    total = mass.sum(axis=1)
    R = np.stack([placed.pose[:3, :3] for placed in bodies])
    t = np.stack([placed.pose[:3, 3] for placed in bodies])
    frame = np.array([placed.body.inertia_about == "frame" for placed in bodies], dtype=float)
    r = np.einsum("bij,kbj->kbi", R, com) + t
    centre = np.einsum("kb,kbi->ki", mass, r) / total[:, None]
    central = tensor(inertia) - (mass * frame)[..., None, None] * parallel_axis(com)
    about_origin = R @ central @ np.swapaxes(R, -1, -2) + mass[..., None, None] * parallel_axis(r)
    about_com = about_origin.sum(axis=1) - total[:, None, None] * parallel_axis(centre)
    return np.concatenate([total[:, None], centre, tensor_entries(about_com)], axis=1)


def sampled(bodies: list[PlacedBody], rng: np.random.Generator, count: int) -> Array:
    """Members of the box, most of them with many coordinates at end points, where extremes are."""

    def draw(part: Uncertain) -> Array:
        shape = (count, *part.nominal.shape)
        inner = rng.random(shape)
        share = np.where(rng.random(shape) < rng.random((count,) + (1,) * part.nominal.ndim), inner.round(), inner)
        return np.asarray(part.interval.inf + share * (part.interval.sup - part.interval.inf))

    drawn = [[draw(getattr(placed.body, key)) for placed in bodies] for key in ("mass", "com", "inertia")]
    return compose(bodies, *(np.stack(part, axis=1) for part in drawn))


@pytest.mark.parametrize("about", ["com", "frame"])
@pytest.mark.parametrize("aligned", [True, False])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_tight_ranges_hold_every_sample_and_published_ones_hold_the_tight(
    count: int, aligned: bool, about: InertiaPoint
) -> None:
    rng = np.random.default_rng([count, aligned, about == "com"])
    for _ in range(5):
        bodies = random_bodies(rng, count, about, aligned)
        robot = one_link(bodies)
        low, high = flat(tight_intervals(robot, EYE[None]))
        samples = sampled(bodies, rng, 20_000)
        assert np.all(samples >= low)
        assert np.all(samples <= high)
        published_low, published_high = flat(published_intervals(robot, EYE[None]))
        # The search for the inertia's range stops at 1e-9 of terms that are below 10 kg m^2 here.
        assert np.all(published_low <= low + 1e-8)
        assert np.all(published_high >= high - 1e-8)


def all_vertices(bodies: list[PlacedBody]) -> Array:
    """Parameters at all vertices of the boxes of (mass, com), the bodies' own tensors at their midpoints."""
    ends = [[placed.body.mass.interval, *(placed.body.com.interval[k] for k in range(3))] for placed in bodies]
    lists = [(float(item.inf), float(item.sup)) for body in ends for item in body]
    points = np.array(list(product(*lists))).reshape(-1, len(bodies), 4)
    own = np.stack([placed.body.inertia.interval.mid for placed in bodies])
    return compose(bodies, points[..., 0], points[..., 1:], np.broadcast_to(own, (len(points), *own.shape)))


@pytest.mark.parametrize("about", ["com", "frame"])
def test_tight_ranges_are_reached_at_vertices_when_levers_keep_their_sign(about: InertiaPoint) -> None:
    """Small boxes far apart: every gradient keeps its sign, so all extremes are vertices."""
    rng = np.random.default_rng(7)
    for _ in range(5):
        bodies = []
        for k in range(2):
            com = np.array([0.2, -0.15, 0.25]) * (1 if k else -0.5)
            parts = (
                uncertain(np.asarray(1.0 + k), np.asarray(1.1 + k)),
                uncertain(com - 0.004 * rng.random(3), com + 0.004 * rng.random(3)),
                Uncertain.exact([0.02, 0.0, 0.0, 0.02, 0.0, 0.02]),
            )
            bodies.append(PlacedBody(1, EYE, RigidBody(f"b{k}", *parts, about)))
        low, high = flat(tight_intervals(one_link(bodies), EYE[None]))
        vertices = all_vertices(bodies)
        np.testing.assert_allclose(low, vertices.min(axis=0), rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(high, vertices.max(axis=0), rtol=0.0, atol=1e-11)


def test_interior_optimum_is_found() -> None:
    """Two bodies whose com boxes overlap in y and z: the least I_xx has both at one point, not at a vertex."""
    parts = (Uncertain.exact(1.0), uncertain(np.full(3, -0.01), np.full(3, 0.01)), Uncertain.exact(np.zeros(6)))
    bodies = [PlacedBody(1, from_xyz_rpy([x, 0.0, 0.0], [0.0, 0.0, 0.0]), RigidBody("b", *parts)) for x in (0.0, 0.3)]
    inertia = tight_intervals(one_link(bodies), EYE[None]).inertia_com[0]
    assert float(inertia.inf[0]) == pytest.approx(0.0, abs=1e-9)
    # reduced mass 1/2, largest distance in the y-z plane (0.02, 0.02)
    assert float(inertia.sup[0]) == pytest.approx(0.5 * 2 * 0.02**2, abs=1e-9)


def test_ends_hold_the_exact_rational_value() -> None:
    """Exact boxes: mass, com and I_xx in rational arithmetic of the given doubles lie inside, closely."""
    rng = np.random.default_rng(11)
    for _ in range(200):
        bodies = []
        for k in range(3):
            mass, com = rng.uniform(0.1, 3.0), rng.uniform(-0.2, 0.2, 3)
            exact = (Uncertain.exact(mass), Uncertain.exact(com), Uncertain.exact(rng.uniform(0.01, 0.02, 6)))
            pose = from_xyz_rpy(rng.uniform(-0.3, 0.3, 3), np.zeros(3))
            bodies.append(PlacedBody(1, pose, RigidBody(f"b{k}", *exact)))
        m = [Fraction(float(p.body.mass.nominal)) for p in bodies]
        r = [[Fraction(float(p.body.com.nominal[k])) + Fraction(float(p.pose[k, 3])) for k in range(3)] for p in bodies]
        total = sum(m)
        c = [sum(mb * rb[k] for mb, rb in zip(m, r, strict=True)) / total for k in range(3)]
        xx = sum(
            Fraction(float(p.body.inertia.nominal[0])) + mb * ((rb[1] - c[1]) ** 2 + (rb[2] - c[2]) ** 2)
            for p, mb, rb in zip(bodies, m, r, strict=True)
        )
        low, high = flat(tight_intervals(one_link(bodies), EYE[None]))
        for index, value in ((0, total), (1, c[0]), (2, c[1]), (3, c[2]), (4, xx)):
            assert Fraction(float(low[index])) <= value <= Fraction(float(high[index]))
            assert high[index] - low[index] < 1e-12


def test_light_and_massless_bodies() -> None:
    """A mass that may be zero, and links without bodies: finite tight ranges, no NaN."""
    maybe = RigidBody(
        "maybe",
        uncertain(np.asarray(0.0), np.asarray(1.0)),
        uncertain(np.array([0.1, 0.0, 0.0]), np.array([0.2, 0.0, 0.0])),
        Uncertain.exact(np.zeros(6)),
    )
    robot = one_link([PlacedBody(1, EYE, maybe)])
    tight = tight_intervals(robot, EYE[None])
    assert np.isfinite(tight.com.inf).all()
    assert np.isfinite(tight.inertia_com.sup).all()
    assert bool(tight.com[0].encloses(maybe.com.interval).all())
    empty = tight_intervals(one_link([]), EYE[None])
    assert np.all(empty.mass.mag == 0.0)
    assert np.all(published_intervals(one_link([]), EYE[None]).inertia_com.mag == 0.0)
