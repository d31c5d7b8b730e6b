"""Logs against their bands and against what is usually done instead."""

from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.collision.bands import state_widths, torque_band
from modrob_cli.collision.baselines import TunedObserver, beyond, constant_thresholds, tune_observer
from modrob_cli.collision.events import Band, Event, Score, find_events, score
from modrob_cli.collision.filters import RunningFilter
from modrob_cli.collision.observer import MomentumTerms, external_torque, momentum_terms
from modrob_cli.collision.sensitivity import ContactForces, contact_forces
from modrob_cli.collision.tables import ThresholdTable, threshold_table
from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.dynamics.width_share import WidthShare
from modrob_cli.errors import UsageError
from modrob_cli.model.motion import MotionPiece
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.bounds_method import Tolerances, shares
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_runs import CollisionRun

FORCE_SAMPLES, SHARE_SAMPLES = 600, 200
"""Of a longer motion, so many evenly picked samples tell about contact forces and about where the width comes from."""
_REMEMBERED = 0.01
"""A filter has forgotten a sample where the sum of the rest of abs(h) is below this."""


@dataclass(frozen=True)
class Method:
    """One way to detect, on one log.

    Attributes
    ----------
    name : bands, ianea, constant, observer
    excess : signed distance from the thresholds, 0 inside and where samples do not count, shape (N, n)
    score : against known contacts; a log that does not tell about contacts counts as one without
    """

    name: str
    excess: Array
    events: list[Event]
    score: Score


@dataclass(frozen=True)
class Learned:
    """What training runs taught: thresholds of the filtered residual, shape (n,), and the observer."""

    constant: Array
    observer: TunedObserver


@dataclass(frozen=True)
class JudgedRun:
    """One log or planned motion with everything that is known of it.

    Attributes
    ----------
    band : filtered; the measurement of a planned motion is its nominal torque
    other : the other kind of bands, to compare with; None if not wanted
    methods : the chosen one first; none for a planned motion
    picked : samples at which contact forces were looked at;  forces : for each point
    shares : where the width comes from, per joint
    """

    run: CollisionRun
    filter: RunningFilter
    band: Band
    other: Band | None
    methods: list[Method]
    picked: Indices
    forces: list[ContactForces]
    shares: list[list[WidthShare]]
    table: ThresholdTable

    @property
    def width(self) -> Array:
        """Of the filtered band: the torque that is certain to be found, shape (N, n)."""
        return self.band.upper - self.band.lower

    @property
    def other_width(self) -> Array | None:
        """Width of the other kind of bands."""
        return None if self.other is None else self.other.upper - self.other.lower

    @property
    def counted(self) -> Array:
        """Width at the samples that count, shape (N', n)."""
        return self.width[self.run.used]


def learn(runs: list[CollisionRun], options: CollisionOptions) -> Learned | None:
    """Learn thresholds from training runs; None without any."""
    if not runs:
        return None
    residuals, terms = [], []
    for run in runs:
        band, _, _ = filtered_band(run, options)
        residuals.append(band.residual[run.used])
        terms.append(_terms(run))
    observer = tune_observer(terms, options.margin)
    return Learned(constant_thresholds(residuals, options.margin), observer)


def _terms(run: CollisionRun) -> MomentumTerms:
    if run.tau is None:
        raise UsageError(f"--train: {run.path} is a planned motion; expected a log")
    return momentum_terms(run.robot, run.motion.t, run.motion.q, run.motion.dq, run.tau)


def judge_run(run: CollisionRun, options: CollisionOptions, learned: Learned | None) -> JudgedRun:
    """Bands, events, baselines and sensitivity of one log."""
    band, other, running = filtered_band(run, options, options.compare)
    methods = []
    if run.tau is not None:
        found = {"bands": band.excess}
        if other is not None:
            found["ianea" if options.method == "exact" else "exact"] = other.excess
        if learned is not None:
            found["constant"] = beyond(band.residual, learned.constant)
            estimate = external_torque(_terms(run), learned.observer.gain)
            found["observer"] = beyond(estimate, learned.observer.thresholds)
        methods = [_method(run, name, excess, options) for name, excess in found.items()]
    motion, width = run.motion, band.upper - band.lower
    picked = np.unique(np.linspace(0, len(motion.t) - 1, FORCE_SAMPLES).astype(int))
    picked = picked[run.used[picked]] if run.used[picked].any() else picked
    points = options.link_points(run.robot)
    forces = [contact_forces(run.robot, motion.q[picked], width[picked], point) for point in points]
    table = threshold_table(run.robot, motion.q, motion.ddq, band, _memory(running))
    return JudgedRun(run, running, band, other, methods, picked, forces, _shares(run), table)


def filtered_band(
    run: CollisionRun, options: CollisionOptions, compare: bool = False
) -> tuple[Band, Band | None, RunningFilter]:
    """The band that was asked for, the other kind if wanted, and the filter of both."""
    running = options.filter.at(run.motion.rate)
    widths = state_widths(run.robot, run.motion)
    links = _links(run.robot) if options.method == "ianea" or compare else None
    kinds = [links if options.method == "ianea" else None]
    if compare:
        kinds.append(None if options.method == "ianea" else links)
    bands = [_filtered(run, torque_band(run.robot, run.motion, kind, widths), running) for kind in kinds]
    return bands[0], (bands[1] if compare else None), running


def _links(robot: Robot) -> LinkBoxes:
    """Link parameters in the D-H frames, as published, but tight, so that only the algorithm itself is compared."""
    frames = dh_table(robot).frames
    tight = tight_intervals(robot, frames)
    return LinkBoxes(tight.mass, tight.com, tight.inertia_com, frames)


def _filtered(run: CollisionRun, bounds: TorqueBounds, running: RunningFilter) -> Band:
    lower, upper = running.bounds(bounds.lower - run.tau_noise, bounds.upper + run.tau_noise)
    middle = running.apply(bounds.nominal)
    measured = middle if run.tau is None else running.apply(run.tau)
    return Band(run.motion.t, measured, lower, upper, middle)


def _method(run: CollisionRun, name: str, excess: Array, options: CollisionOptions) -> Method:
    excess = np.where(run.used[:, None], excess, 0.0)
    events = find_events(run.motion.t, excess, options.rules)
    return Method(name, excess, events, score(run.motion.t, excess, events, run.contacts or (), options.settle))


def _memory(running: RunningFilter) -> int:
    """Samples after which a filter has forgotten."""
    rest = np.abs(running.response)[::-1].cumsum()[::-1]
    return int(np.count_nonzero(rest > _REMEMBERED))


def _shares(run: CollisionRun) -> list[list[WidthShare]]:
    motion = run.motion
    picked = np.unique(np.linspace(0, len(motion.t) - 1, SHARE_SAMPLES).astype(int))
    piece = MotionPiece(motion.t[picked], motion.q[picked], motion.dq[picked], motion.ddq[picked])
    found = shares(
        run.robot, piece, Tolerances(motion.q_rad, motion.dq_rad, np.atleast_2d(motion.ddq_rad).mean(axis=0))
    )
    return [_with_effort(run, j, ranking) for j, ranking in enumerate(found)]


def _with_effort(run: CollisionRun, j: int, ranking: list[WidthShare]) -> list[WidthShare]:
    """Add the noise of the measured effort to what makes a joint's band wide."""
    noise = 2.0 * float(run.tau_noise[j])
    if noise == 0.0:
        return ranking
    total = sum(share.width for share in ranking) + noise
    parts = [replace(share, share=share.width / total) for share in ranking]
    parts.append(WidthShare(f"{run.robot.joint_names[j]} effort noise", noise, noise / total))
    return sorted(parts, key=lambda share: -share.width)
