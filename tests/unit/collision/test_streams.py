"""Logs judged stretch by stretch through temporary files: the same as read and judged whole, in bounded memory."""

import itertools
import tracemalloc
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.collision.acceleration import measured_acceleration
from modrob_cli.collision.bands import UncertainMotion, torque_band
from modrob_cli.dynamics.drive_torque import drive_nominal
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.errors import InputFileError
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.long_topics import LATE, LongTopic, open_long_run
from modrob_cli.io.mcap_writer import McapWriter, Series, write_mcap
from modrob_cli.io.ros_messages import controller_state, joint_state, wrench_stamped
from modrob_cli.io.run_topics import PushTimes, TopicSeries
from modrob_cli.model.robot import Robot
from modrob_cli.plot.collision import _visible
from modrob_cli.workflows.collision_banding import learn
from modrob_cli.workflows.collision_judge import JudgedStretch, judge_stream
from modrob_cli.workflows.collision_load import open_run
from modrob_cli.workflows.collision_options import CollisionOptions, parse_filter
from modrob_cli.workflows.collision_result import log_result
from modrob_cli.workflows.collision_runs import CollisionRun, RunHead
from modrob_cli.workflows.collision_smoothed import aligned
from modrob_cli.workflows.robots import load_robot

ROOT = Path(__file__).parents[3]
RATE, START = 250, 1_750_000_000_000_000_000
STATED: dict[str, Any] = {
    "effort": "torque", "q_noise": [1e-5], "dq_noise": [1e-4], "effort_noise": [0.2],
    "filter": parse_filter("butterworth2:20"),
}  # fmt: skip


@dataclass(frozen=True)
class Made:
    """A log and what is in it."""

    path: Path
    robot: Robot
    t: Array
    q: Array
    dq: Array
    ddq: Array
    tau: Array


def make_log(path: Path, seconds: float, pushes: list[tuple[float, float]], jitter: float = 0.0) -> Made:
    """Six joints on sines with the nominal torque, noise, pushes of the second joint; written in pieces."""
    robot = load_robot(ROOT / "assemblies" / "lwa4p-6-payload.yaml").robot
    rng = np.random.default_rng(11)
    nominal = np.arange(int(seconds * RATE)) / RATE
    stamps = START + np.rint((nominal + rng.uniform(0.0, jitter, len(nominal))) * 1e9).astype(np.int64)
    t = (stamps - stamps[0]) / 1e9
    w = np.array([0.7, 0.9, 0.5, 1.3, 0.8, 0.6])
    q, dq = 0.5 * np.sin(t[:, None] * w), 0.5 * w * np.cos(t[:, None] * w)
    ddq = -w * w * q
    tau = rnea(robot, q, dq, ddq)
    for i, joint in enumerate(robot.joints):
        tau[:, i] += drive_nominal(joint, dq[:, i], ddq[:, i], robot.disturbance[i])
    pushing = np.zeros(len(t), dtype=bool)
    for first, last in pushes:
        pushing |= (t >= first) & (t < last)
    tau += rng.uniform(-0.2, 0.2, tau.shape)
    tau[:, 1] += 45.0 * pushing
    dq = dq + rng.uniform(-1e-4, 1e-4, dq.shape)
    states = controller_state(robot.joint_names, {"reference": ("positions", "velocities", "accelerations")})
    series = [
        Series("/joint_states", joint_state(robot.joint_names), stamps, np.hstack([q, dq, tau])),
        Series("/controller_state", states, stamps, np.hstack([q, dq, ddq])),
        Series("/contacts/push", wrench_stamped("base"), stamps, np.where(pushing[:, None], -60.0, 0.0) * np.eye(6)[2]),
    ]
    with McapWriter(path, [(one.topic, one.layout) for one in series]) as writer:
        for first in range(0, len(t), 777):
            part = slice(first, first + 777)
            writer.add([replace(one, stamps=one.stamps[part], values=one.values[part]) for one in series])
    return Made(path, robot, t, q, dq, ddq, tau)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Five seconds with two pushes; the second one lies across the end of a stretch of 200 samples."""
    return make_log(tmp_path_factory.mktemp("streams") / "log.mcap", 5.0, [(1.3, 1.5), (3.1, 3.7)], 5e-4)


def judged(
    made: Made, options: CollisionOptions, stretch: int, long: bool, train: bool = False
) -> tuple[dict[str, Any], Array]:
    """The result of a log, and time, measured torque, bands and excess of all samples."""
    learned, rows = None, []

    def watch(part: JudgedStretch) -> None:
        band = part.band
        rows.append(np.hstack([band.t[:, None], band.measured, band.lower, band.upper, part.excess]))

    if train:
        with open_run(made.robot, made.path, "log", options, stretch, long) as stream:
            learned = learn([stream], options)
    with open_run(made.robot, made.path, "log", options, stretch, long) as stream:
        result = log_result(judge_stream(stream, options, learned, [watch]), options)
    return result, np.concatenate(rows)


def same(one: Any, other: Any, where: str = "$") -> None:
    """Texts and counts equal, numbers to 1e-9."""
    if isinstance(one, dict):
        assert list(one) == list(other), where
        for key in one:
            same(one[key], other[key], f"{where}.{key}")
    elif isinstance(one, list):
        assert len(one) == len(other), where
        for k, (left, right) in enumerate(zip(one, other, strict=True)):
            same(left, right, f"{where}[{k}]")
    elif isinstance(one, float):
        # A peak is the small difference of a torque and a bound: 1e-9 of those, which are of the order of 10.
        assert other == pytest.approx(one, rel=1e-9, abs=1e-8), where
    else:
        assert one == other, where


WAYS: dict[str, dict[str, Any]] = {
    "desired": {"ddq_tolerance": [0.5]},
    "skip and IANEA": {"ddq_tolerance": [0.5], "skip": 1.01, "method": "ianea", "shortest": 0.02},
    "measured": {"acceleration": "measured", "jerk": [10.0], "jump": [1.0], "still": [0.01]},
    "smoothed": {"acceleration": "smoothed", "ddq_tolerance": [0.5], "skip": 1.0, "cutoff": 12.0, "compare": False},
}


@pytest.mark.parametrize("way", WAYS)
def test_stretches_and_temporary_files_change_nothing(made: Made, way: str) -> None:
    options = CollisionOptions(**STATED, **WAYS[way])
    whole, series = judged(made, options, 2**62, long=False, train=way == "desired")
    parts, pieces = judged(made, options, 200, long=True, train=way == "desired")
    same(whole, parts)
    # Torques and bounds are of the order of 10 to 100.
    assert np.allclose(series, pieces, rtol=1e-9, atol=1e-9)
    assert whole["contacts"] is not None
    ends = [(contact["start"], contact["end"]) for contact in whole["contacts"]]
    assert np.allclose(ends, [(1.3, 1.5), (3.1, 3.7)], atol=5e-3)  # to the next sample
    assert len(whole["events"]) >= 2
    assert whole["methods"][0]["false_alarms"] == 0


def test_the_bands_of_stretches_are_those_of_the_motion(made: Made) -> None:
    """Against the band of all samples at once and a convolution, from the numbers that were written into the log."""
    options = CollisionOptions(**STATED, ddq_tolerance=[0.5], compare=False)
    result, pieces = judged(made, options, 200, long=True)
    n = made.robot.dof
    rad = [np.full(n, value) for value in (1e-5, 1e-4, 0.5)]
    motion = UncertainMotion(made.t, made.q, made.dq, made.ddq, rad[0], rad[1], rad[2])
    bounds = torque_band(made.robot, motion)
    running = options.filter.at(motion.rate)
    half = 0.5 * (bounds.upper - bounds.lower) + 0.2
    held = np.concatenate([np.broadcast_to(half[0], (len(running.response) - 1, n)), half])
    wide = np.stack([np.convolve(x, np.abs(running.response), mode="valid") for x in held.T], axis=1)
    # The allowance for rounding is 1e-9 of torques below 100.
    assert np.allclose(pieces[:, 1 + 2 * n : 1 + 3 * n] - pieces[:, 1 + n : 1 + 2 * n], 2.0 * wide, atol=5e-7)
    event = result["events"][-1]
    assert event["joint"] == made.robot.joint_names[1]
    assert 3.1 < event["start"] < 3.14
    assert 3.7 <= event["end"] < 3.8
    closest = {joint["joint"]: joint for joint in result["closest"]}[event["joint"]]
    assert closest["share"] > 1.0
    assert event["start"] <= closest["time"] <= event["end"] or closest["time"] < 1.6


@pytest.mark.parametrize("long", [False, True])
def test_reversals_at_the_ends_of_stretches_count(made: Made, tmp_path: Path, long: bool) -> None:
    """Accelerations and their tolerances against those of all samples at once; velocities change their signs often."""
    rng = np.random.default_rng(15)
    N = 600
    dq = rng.normal(size=(N, 6)) + 3.0 * np.sign(np.sin(np.arange(N) / 9.0))[:, None]
    stamps = START + np.arange(N, dtype=np.int64) * 4_000_000 + rng.integers(0, 900_000, N)
    values = np.hstack([made.q[:N], dq, made.tau[:N]])
    layout = joint_state(made.robot.joint_names)
    write_mcap(tmp_path / "log.mcap", [Series("/joint_states", layout, stamps, values)])
    options = CollisionOptions(acceleration="measured", dq_noise=[2e-3], jerk=[40.0], jump=[2.0], still=[0.1])
    t = (stamps - stamps[0]) / 1e9
    ddq, tolerance, first = measured_acceleration(t, dq, options.velocity_knowledge(made.robot))
    assert first == 4
    with open_run(made.robot, tmp_path / "log.mcap", "log", options, 10, long) as stream:
        parts = list(stream.stretches())
    assert len(parts) == 60
    assert np.allclose(np.concatenate([part.motion.ddq for part in parts]), ddq[4:], rtol=1e-12)
    assert np.allclose(np.concatenate([part.motion.ddq_rad for part in parts]), tolerance[4:], rtol=1e-12)
    assert np.array_equal(stream.survey.least_rad, tolerance[4:].min(axis=0))


def test_memory_does_not_grow_with_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three times the samples, the same peak. At once, the arrays of a log take 8 kB for each sample."""
    # What is kept of every log is the same for logs of more than some thousand samples: here, of more than 500.
    monkeypatch.setattr("modrob_cli.collision.tables.MOST_POSES", 500)
    monkeypatch.setattr("modrob_cli.workflows.collision_picks.MOST_WIDTHS", 500)
    monkeypatch.setattr("modrob_cli.workflows.collision_judge.FORCE_SAMPLES", 200)
    options = CollisionOptions(**STATED, ddq_tolerance=[0.5], compare=False)
    peaks = []
    for seconds in (2.0, 4.0, 12.0):  # the first one imports what is needed
        made = make_log(tmp_path / f"log-{seconds}.mcap", seconds, [(1.0, 1.2)])
        with open_run(made.robot, made.path, "log", options, 500, True, 300) as stream:
            tracemalloc.start()
            try:
                judge_stream(stream, options, None)
                peaks.append(tracemalloc.get_traced_memory()[1])
            finally:
                tracemalloc.stop()
    assert peaks[2] < peaks[1] + 200 * 2000


def samples_of(head: RunHead, used: NDArray[np.bool_]) -> CollisionRun:
    t = np.arange(float(len(used)))
    states = [np.zeros((len(used), 6))] * 3
    run = head.run(CollisionOptions(), t, states, np.zeros(6), np.zeros((len(used), 6)), "test")
    return replace(run, used=used)


@pytest.mark.parametrize("skip", [0.0, 3.0, 41.5, 97.0])
def test_stretches_begin_where_samples_count(skip: float) -> None:
    """Pieces of any length become stretches of equal length from the first to the last sample that counts."""
    robot = load_robot(ROOT / "assemblies" / "lwa4p-6.yaml").robot
    rng = np.random.default_rng(12)
    used = rng.random(100) < 0.3
    used[:7] = used[40:75] = used[95:] = False
    run = samples_of(RunHead(Path("x"), "x", robot, 0, 1.0), used)
    edges = [0, 3, 4, 20, 55, 56, 90, 100]
    pieces = (run.part(first, last) for first, last in zip(edges[:-1], edges[1:], strict=True))
    found = list(aligned(pieces, 16, skip))
    first, last = int(used.argmax()), int(np.flatnonzero(used)[-1]) + 1
    wanted = [k for k in range(first, last) if k >= skip]
    assert [len(part.used) for part in found[:-1]] == [16] * (len(found) - 1)
    assert [k for part in found for k in part.motion.t] == wanted
    assert [int(k) for part in found for k in part.motion.t[part.used]] == [k for k in wanted if used[k]]


def test_pushes_do_not_depend_on_the_cuts() -> None:
    rng = np.random.default_rng(13)
    stamps = np.cumsum(rng.integers(1, 9, 200))
    values = np.where(rng.random((200, 1)) < 0.6, 0.0, 2.0) * np.array([0.0, 1.0])
    values[-1] = 1.0
    times = PushTimes()
    for first in range(0, 200, 7):
        times.add(stamps[first : first + 7], values[first : first + 7])
    wanted, start = [], None
    for stamp, pushing in zip(stamps.tolist(), values.any(axis=1).tolist(), strict=True):
        if pushing and start is None:
            start = stamp
        elif not pushing and start is not None:
            wanted.append((start, stamp))
            start = None
    wanted.append((start, int(2 * stamps[-1] - stamps[-2])))
    assert list(times.windows) == wanted


def test_a_topic_is_put_in_the_order_of_its_times() -> None:
    """Messages that come late by less than a second, and repeated ones; those that come later are passed over."""
    rng = np.random.default_rng(14)
    stamps = np.arange(2000, dtype=np.int64) * 10_000_000
    order = np.argsort(stamps + rng.integers(0, LATE // 2, 2000), kind="stable")
    values = np.stack([np.zeros((2000, 2)), np.ones((2000, 2)), stamps[:, None] * [1.0, -1.0]])
    topic = LongTopic("/x", "desired", ("a", "b"), 300)
    for first in range(0, 2000, 90):
        chosen = order[first : first + 90]
        topic.add(np.concatenate([stamps[chosen], stamps[chosen[:3]]]), values[:, np.concatenate([chosen, chosen[:3]])])
    topic.add(stamps[:1], values[:, :1])
    topic.flush(last=True)
    assert topic.count == 2000
    assert np.array_equal(topic.times(0, 2000), stamps)
    assert topic.finite.all()
    found, third = topic.around(int(stamps[700]) + 1, int(stamps[800]) + 1)
    assert np.array_equal(found, stamps[700:802])
    assert np.array_equal(third, values[2, 700:802])
    assert len(topic.around(-5, -1)[0]) == 1
    assert topic.around(int(stamps[-1]) + 7, int(stamps[-1]) + 9)[0].tolist() == [stamps[-1]]
    whole = TopicSeries("/x", ("a", "b"), stamps, values)
    assert (whole.count, whole.finite.tolist()) == (2000, [True, True])
    topic.close()


def test_topics_of_a_long_log(made: Made) -> None:
    with open_long_run(made.path, made.robot.joint_names, LogOptions(), window=100) as found:
        (desired,) = found.desired
        stamps, ddq = desired.around(START, START + 10**11)
        assert np.array_equal((stamps - stamps[0]) / 1e9, made.t)
        assert np.array_equal(ddq, made.ddq)
        assert found.labelled
        assert [contact.name for contact in found.contacts] == ["push"]


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({}, "no topic of a controller with desired accelerations"),
        ({"acceleration": "measured", "jerk": [10.0]}, "the log has no velocities"),
        ({"acceleration": "smoothed", "skip": 50.0}, "--skip 50 leaves nothing"),
    ],
)
def test_what_a_log_lacks_is_said(made: Made, tmp_path: Path, long: bool, more: dict[str, Any], said: str) -> None:
    layout = joint_state(made.robot.joint_names, velocity=False)
    stamps = START + np.rint(made.t * 1e9).astype(np.int64)
    write_mcap(tmp_path / "bare.mcap", [Series("/joint_states", layout, stamps, np.hstack([made.q, made.tau]))])
    options = CollisionOptions(**STATED, **more)
    with (
        pytest.raises(InputFileError, match=said),
        open_run(made.robot, tmp_path / "bare.mcap", "bare", options, 200, long),
    ):
        pass


def test_any_number_of_events_is_drawn_in_spans_that_cover_them() -> None:
    """Against a mark for each: what is covered is the same, and the spans stay apart and few."""
    rng = np.random.default_rng(5)
    starts = rng.uniform(0.0, 100.0, 3000)
    events = list(zip(starts.tolist(), (starts + rng.exponential(0.02, 3000)).tolist(), strict=True))
    least = 0.2
    spans = _visible(events, least)
    assert len(spans) <= 100.0 / least
    assert all(one[1] < other[0] for one, other in itertools.pairwise(spans))
    grid = np.linspace(-1.0, 102.0, 20_000)
    marked = np.zeros(len(grid), dtype=bool)
    for start, end in events:
        marked |= (grid >= start) & (grid <= max(end, start + least))
    covered = np.zeros(len(grid), dtype=bool)
    for start, end in spans:
        covered |= (grid >= start) & (grid <= end)
    assert np.array_equal(marked, covered)
