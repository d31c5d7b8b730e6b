"""Motions that come in pieces: thinning, limits, envelopes; against the whole motion at once."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.errors import ShapeError
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Joint, Limits
from modrob_cli.model.motion import LimitWatch, MotionPiece, ThinnedMotion
from modrob_cli.model.robot import Robot
from modrob_cli.plot.envelope import Envelope


def some_motion(count: int, dof: int = 2) -> MotionPiece:
    rng = np.random.default_rng(count)
    return MotionPiece(np.arange(count, dtype=float) * 0.1, *(rng.normal(size=(count, dof)) for _ in range(3)))


def in_pieces(motion: MotionPiece, seed: int) -> list[MotionPiece]:
    rng = np.random.default_rng(seed)
    edges = [0, *np.sort(rng.integers(1, len(motion.t), size=7)).tolist(), len(motion.t)]
    keys = ("t", "q", "dq", "ddq")
    spans = [slice(a, b) for a, b in zip(edges, edges[1:], strict=False) if b > a]
    return [MotionPiece(*(getattr(motion, key)[span] for key in keys)) for span in spans]


def test_shapes_have_to_fit() -> None:
    good = some_motion(4)
    with pytest.raises(ShapeError):
        replace(good, dq=good.dq[:3])
    with pytest.raises(ShapeError):
        replace(good, q=good.t)
    with pytest.raises(ShapeError, match="without samples"):
        ThinnedMotion(5).motion()


@pytest.mark.parametrize(("count", "step"), [(10, 1), (100, 1), (101, 2), (200, 2), (201, 4), (1600, 16), (1601, 32)])
@pytest.mark.parametrize("seed", range(3))
def test_thinning_keeps_every_nth_sample(count: int, step: int, seed: int) -> None:
    motion = some_motion(count)
    thinned = ThinnedMotion(100)
    for piece in in_pieces(motion, seed):
        thinned.add(piece)
    kept = thinned.motion()
    assert thinned.step == step
    for key in ("t", "q", "dq", "ddq"):
        assert np.array_equal(getattr(kept, key), getattr(motion, key)[::step])


@pytest.mark.parametrize("count", [8, 12, 40, 41, 79, 1000, 1001, 12_345])
@pytest.mark.parametrize("seed", range(3))
def test_envelope_is_that_of_runs_of_samples(count: int, seed: int) -> None:
    motion = some_motion(count)
    values = np.stack([motion.q, motion.dq, motion.ddq], axis=1)
    envelope = Envelope(3, 2, most=20)
    for piece in in_pieces(motion, seed):
        envelope.add(piece.t, np.stack([piece.q, piece.dq, piece.ddq], axis=1))
    t, bands = envelope.bands()
    size = envelope.size
    assert len(t) <= 40
    assert size == 1 or len(t) >= 20
    starts = np.arange(0, count, size)
    ends = np.minimum(starts + size, count) - 1
    np.testing.assert_allclose(t, 0.5 * (motion.t[starts] + motion.t[ends]))
    for k, band in enumerate(bands):
        assert np.array_equal(band.low, np.minimum.reduceat(values[:, k], starts))
        assert np.array_equal(band.high, np.maximum.reduceat(values[:, k], starts))


def test_limits_over_pieces() -> None:
    limits = Limits(position=(-1.0, 1.5), acceleration=(-0.5, 0.5))
    joints = (Joint("free", "revolute", np.eye(4)), Joint("held", "revolute", np.eye(4), limits=limits))
    robot = Robot("two", joints, (), np.eye(4), np.zeros(3), Interval(np.zeros(2)))
    motion = some_motion(500)
    watch = LimitWatch(robot)
    for piece in in_pieces(motion, 1):
        watch.add(piece)
    position, acceleration = watch.found()
    for excess, values, (low, high) in (
        (position, motion.q[:, 1], (-1.0, 1.5)),
        (acceleration, motion.ddq[:, 1], (-0.5, 0.5)),
    ):
        outside = (values < low) | (values > high)
        beyond = np.maximum(low - values, values - high)
        assert excess.joint == "held"
        assert excess.count == outside.sum()
        assert excess.first_time == motion.t[outside][0]
        assert excess.worst == beyond.max()
        assert excess.worst_time == motion.t[beyond.argmax()]


def test_touching_a_limit_is_allowed() -> None:
    limits = Limits(position=(-1.0, 1.0))
    robot = Robot(
        "one", (Joint("j", "revolute", np.eye(4), limits=limits),), (), np.eye(4), np.zeros(3), Interval(np.zeros(1))
    )
    watch = LimitWatch(robot)
    q = np.array([[1.0], [np.nextafter(1.0, 2.0)], [-1.0 - 1e-10]])
    watch.add(MotionPiece(np.arange(3.0), q, 0.0 * q, 0.0 * q))
    assert watch.found() == []
    watch.add(MotionPiece(np.array([3.0]), np.array([[1.0 + 1e-6]]), np.zeros((1, 1)), np.zeros((1, 1))))
    assert [excess.first_time for excess in watch.found()] == [3.0]
