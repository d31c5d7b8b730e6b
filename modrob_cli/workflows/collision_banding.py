"""Filtered bands along runs, and what training runs teach."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.collision.bands import state_widths, torque_band
from modrob_cli.collision.baselines import ObserverTuner, TunedObserver
from modrob_cli.collision.events import Band
from modrob_cli.collision.filters import BoundsRun, FilterRun, RunningFilter
from modrob_cli.collision.observer import MomentumTerms, momentum_terms
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.errors import UsageError
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_runs import CollisionRun
from modrob_cli.workflows.collision_stream import RunStream


class Banding:
    """Makes the filtered bands of one run, which comes stretch by stretch.

    Parameters
    ----------
    about : any stretch of the run
    compare : also the other kind of bands

    Attributes
    ----------
    filter : of the measurement and of the bands

    Raises
    ------
    NumericalError
        If the filter does not fit the sampling rate.
    """

    def __init__(self, about: CollisionRun, options: CollisionOptions, compare: bool) -> None:
        self.filter: RunningFilter = options.filter.at(about.motion.rate)
        links = link_boxes(about.robot) if options.method == "ianea" or compare else None
        kinds = [links, None] if options.method == "ianea" else [None, links]
        self._kinds = [(kind, BoundsRun(self.filter), FilterRun(self.filter)) for kind in kinds[: 1 + compare]]
        self._measured = FilterRun(self.filter)

    def add(self, run: CollisionRun) -> list[Band]:
        """Bands of the next stretch: the kind that was asked for, then the other if it is wanted.

        Raises
        ------
        NumericalError
            If a band is not finite.
        """
        widths = state_widths(run.robot, run.motion)
        measured = None if run.tau is None else self._measured.apply(run.tau)
        bands = []
        for links, ends, centre in self._kinds:
            found = torque_band(run.robot, run.motion, links, widths)
            lower, upper = ends.bounds(found.lower - run.tau_noise, found.upper + run.tau_noise)
            middle = centre.apply(found.nominal)
            bands.append(Band(run.motion.t, middle if measured is None else measured, lower, upper, middle))
        return bands


def filtered_band(
    run: CollisionRun, options: CollisionOptions, compare: bool = False
) -> tuple[Band, Band | None, RunningFilter]:
    """Bands of a whole run that is in memory: the kind that was asked for, the other if wanted, the filter of both."""
    banding = Banding(run, options, compare)
    bands = banding.add(run)
    return bands[0], bands[1] if compare else None, banding.filter


def link_boxes(robot: Robot) -> LinkBoxes:
    """Link parameters in the D-H frames, as published, but tight, so that only the algorithm itself is compared."""
    frames = dh_table(robot).frames
    tight = tight_intervals(robot, frames)
    return LinkBoxes(tight.mass, tight.com, tight.inertia_com, frames)


def observer_terms(run: CollisionRun) -> MomentumTerms:
    """What the momentum observer needs of a stretch.

    Raises
    ------
    UsageError
        If nothing was measured.
    """
    if run.tau is None:
        raise UsageError(f"--train: {run.path} is a planned motion; expected a log")
    return momentum_terms(run.robot, run.motion.t, run.motion.q, run.motion.dq, run.tau)


@dataclass(frozen=True)
class Learned:
    """What training runs taught: thresholds of the filtered residual, shape (n,), and the observer."""

    constant: Array
    observer: TunedObserver


def learn(streams: Iterable[RunStream], options: CollisionOptions) -> Learned | None:
    """Learn thresholds from training runs; None without any."""
    most, tuner, empty = np.zeros(1), ObserverTuner(), True
    for stream in streams:
        empty = False
        banding = Banding(stream.about, options, compare=False)
        tuner.begin()
        for run in stream.stretches():
            residual = banding.add(run)[0].residual[run.used]
            most = np.maximum(most, np.abs(residual).max(axis=0, initial=0.0))
            tuner.add(observer_terms(run))
    return None if empty else Learned((1.0 + options.margin) * most, tuner.tuned(options.margin))
