"""Logs against their bands and against what is usually done instead, stretch by stretch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.collision.baselines import beyond
from modrob_cli.collision.events import Band, Event, EventFinder, Score, Scorer
from modrob_cli.collision.filters import RunningFilter
from modrob_cli.collision.observer import ObserverRun
from modrob_cli.collision.sensitivity import ContactForces, contact_forces
from modrob_cli.collision.tables import TableRun, ThresholdTable
from modrob_cli.dynamics.width_share import WidthShare
from modrob_cli.model.motion import MotionPiece
from modrob_cli.workflows.bounds_method import Tolerances
from modrob_cli.workflows.collision_banding import Banding, Learned, observer_terms
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_picks import Closest, ClosestRun, Picks, Widths, WidthsRun
from modrob_cli.workflows.collision_runs import CollisionRun
from modrob_cli.workflows.collision_shares import width_shares
from modrob_cli.workflows.collision_stream import RunStream, Survey

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
    score : against known contacts; a log that does not tell about contacts counts as one without
    """

    name: str
    events: list[Event]
    score: Score


@dataclass(frozen=True)
class JudgedStretch:
    """One stretch and its bands.

    Attributes
    ----------
    first : number of its first sample in the run
    band : filtered; the measurement of a planned motion is its nominal torque
    other : the other kind of bands, to compare with; None if not wanted
    excess : signed distance from the band, 0 inside and where samples do not count, shape (N, n)
    """

    run: CollisionRun
    first: int
    band: Band
    other: Band | None
    excess: Array


@dataclass(frozen=True)
class JudgedRun:
    """One log or planned motion and what is known of it at its end.

    Attributes
    ----------
    about : any stretch, for what they have in common
    methods : the chosen one first; none for a planned motion
    widths : of the filtered band: the torque that is certain to be found
    closest : how near the measurement came to the ends of its band; None for a planned motion
    picked : times at which contact forces were looked at;  forces : for each point
    shares : where the width comes from, per joint
    """

    about: CollisionRun
    survey: Survey
    filter: RunningFilter
    methods: list[Method]
    widths: Widths
    closest: Closest | None
    picked: Array
    forces: list[ContactForces]
    shares: list[list[WidthShare]]
    table: ThresholdTable


Watcher = Callable[[JudgedStretch], None]
"""Sees each stretch once it is judged, to write or draw it."""


def judge_stream(
    stream: RunStream, options: CollisionOptions, learned: Learned | None, watchers: Sequence[Watcher] = ()
) -> JudgedRun:
    """Bands, events, baselines and sensitivity of one log.

    Raises
    ------
    NumericalError
        If a band is not finite, or a filter does not fit the log.
    """
    judge = _Judge(stream, options, learned)
    for run in stream.stretches():
        judged = judge.add(run)
        for watch in watchers:
            watch(judged)
    return judge.result()


class _Judge:
    """Judges one run."""

    def __init__(self, stream: RunStream, options: CollisionOptions, learned: Learned | None) -> None:
        about, survey = stream.about, stream.survey
        self._about, self._survey, self._options, self._learned = about, survey, options, learned
        self._banding = Banding(about, options, options.compare)
        self._methods: dict[str, tuple[EventFinder, Scorer]] = {}
        self._observer = None if learned is None else ObserverRun(learned.observer.gain)
        self._forces = Picks(survey.samples, FORCE_SAMPLES)
        self._shares = Picks(survey.samples, SHARE_SAMPLES)
        self._widths = WidthsRun()
        self._closest = ClosestRun(about.robot.dof)
        self._table = TableRun(about.robot, survey.most_ddq, _memory(self._banding.filter))
        self._count = 0

    def add(self, run: CollisionRun) -> JudgedStretch:
        """Judge the next stretch."""
        band, *others = self._banding.add(run)
        other = others[0] if others else None
        excess = np.zeros_like(band.lower)
        if run.tau is not None:
            for name, found in self._excesses(run, band, other).items():
                counted = np.where(run.used[:, None], found, 0.0)
                finder, scorer = self._method(name)
                finder.add(run.motion.t, counted)
                scorer.add(run.motion.t, counted)
                excess = counted if name == "bands" else excess
        # Where no sample counts, all of them tell how wide the band is.
        counts = run.used if self._survey.used else np.ones_like(run.used)
        self._look(run, band, other, counts)
        judged = JudgedStretch(run, self._count, band, other, excess)
        self._count += len(run.motion.t)
        return judged

    def _excesses(self, run: CollisionRun, band: Band, other: Band | None) -> dict[str, Array]:
        """Signed distance from the thresholds of each method, shape (N, n)."""
        found = {"bands": band.excess}
        if other is not None:
            found["ianea" if self._options.method == "exact" else "exact"] = other.excess
        if self._learned is not None and self._observer is not None:
            found["constant"] = beyond(band.residual, self._learned.constant)
            found["observer"] = beyond(self._observer.add(observer_terms(run)), self._learned.observer.thresholds)
        return found

    def _method(self, name: str) -> tuple[EventFinder, Scorer]:
        if name not in self._methods:
            contacts = self._about.contacts or ()
            self._methods[name] = EventFinder(self._options.rules), Scorer(contacts, self._options.settle)
        return self._methods[name]

    def _look(self, run: CollisionRun, band: Band, other: Band | None, counts: NDArray[np.bool_]) -> None:
        """Keep what sensitivity and thresholds are made from."""
        motion, width = run.motion, band.upper - band.lower
        self._widths.add(width, None if other is None else other.upper - other.lower, counts)
        if run.tau is not None:
            self._closest.add(band, run.used)
        self._forces.add(motion.t, counts, motion.q, width)
        self._shares.add(motion.t, counts, motion.q, motion.dq, motion.ddq)
        self._table.add(motion.q, motion.ddq, band)

    def result(self) -> JudgedRun:
        """What is known at the end."""
        robot, points = self._about.robot, self._options.link_points(self._about.robot)
        t, counts, q, width = self._forces.arrays()
        if counts.any():
            t, q, width = t[counts], q[counts], width[counts]
        forces = [contact_forces(robot, q, width, point) for point in points]
        methods = [
            Method(name, finder.events, scorer.score(finder.events)) for name, (finder, scorer) in self._methods.items()
        ]
        closest = self._closest.result if self._about.tau is not None else None
        return JudgedRun(
            self._about,
            self._survey,
            self._banding.filter,
            methods,
            self._widths.result(),
            closest,
            t,
            forces,
            self._width_shares(),
            self._table.table(),
        )

    def _width_shares(self) -> list[list[WidthShare]]:
        motion = self._about.motion
        t, _, q, dq, ddq = self._shares.arrays()
        tolerances = Tolerances(motion.q_rad, motion.dq_rad, self._survey.mean_rad)
        return width_shares(self._about.robot, MotionPiece(t, q, dq, ddq), tolerances, self._about.tau_noise)


def _memory(running: RunningFilter) -> int:
    """Samples after which a filter has forgotten."""
    rest = np.abs(running.response)[::-1].cumsum()[::-1]
    return int(np.count_nonzero(rest > _REMEMBERED))
