"""Glitches put into known motions are found and mended; motions without stay as they are."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.identify.signal_glitches import without_glitches
from modrob_cli.model.log import JointLog


def smooth(noise: float = 0.0, quantum: float = 0.0) -> JointLog:
    t = np.arange(0.0, 10.0, 0.01)
    q = np.stack([np.sin(2.0 * t), 0.3 * np.cos(5.0 * t)], axis=1)
    q += noise * np.random.default_rng(1).normal(size=q.shape)
    if quantum:
        q = np.round(q / quantum) * quantum
    return JointLog("log", ("a", "b"), t, q, np.gradient(q, t, axis=0), np.zeros_like(q))


@pytest.mark.parametrize(("noise", "quantum"), [(0.0, 0.0), (1e-3, 0.0), (0.0, 2e-3)])
def test_single_glitches_are_mended(noise: float, quantum: float) -> None:
    log = smooth(noise, quantum)
    q = log.q.copy()
    q[[100, 300, 301, 700], [0, 0, 1, 1]] = [0.0, 50.0, -0.9, 0.0]
    mended, count = without_glitches(replace(log, q=q))
    assert count == 4
    # What replaces a glitch is off by curvature (1e-7 here), noise and quantisation.
    np.testing.assert_allclose(mended.q, log.q, rtol=0, atol=1e-6 + 6.0 * noise + 2.0 * quantum)
    untouched = np.ones(log.q.shape, dtype=bool)
    untouched[[100, 300, 301, 700], [0, 0, 1, 1]] = False
    np.testing.assert_array_equal(mended.q[untouched], log.q[untouched])


@pytest.mark.parametrize(("noise", "quantum"), [(0.0, 0.0), (1e-2, 0.0), (0.0, 5e-3)])
def test_honest_motion_stays(noise: float, quantum: float) -> None:
    log = smooth(noise, quantum)
    assert without_glitches(log)[1] == 0


def test_a_jump_and_a_dropout_stay() -> None:
    log = smooth()
    q = log.q.copy()
    q[500:, 0] += 1.0
    q[200:210, 1] = 0.0
    assert without_glitches(replace(log, q=q))[1] == 0


def test_a_joint_at_rest() -> None:
    log = JointLog("log", ("a",), np.arange(10.0), np.full((10, 1), 0.3), None, np.zeros((10, 1)))
    assert without_glitches(log)[1] == 0
    short = JointLog("log", ("a",), np.arange(3.0), np.zeros((3, 1)), None, np.zeros((3, 1)))
    assert without_glitches(short)[1] == 0
