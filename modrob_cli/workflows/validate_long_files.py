"""Files about a long log: samples as CSV, thinned; a picture and a page of its worst stretch."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from modrob_cli.dynamics.exact_bounds import TorqueBounds
from modrob_cli.errors import NumericalError
from modrob_cli.identify.prediction import prediction_errors
from modrob_cli.identify.run import Run
from modrob_cli.identify.signals import Mask
from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.plot.stretches import stretch_figure
from modrob_cli.report.document import Block, Cell, Picture, Section, Table, Tone
from modrob_cli.report.render import render
from modrob_cli.workflows.identify_runs import LogRun
from modrob_cli.workflows.validate_files import draw_log, series_header, series_rows
from modrob_cli.workflows.validate_judge import JudgedLog, friction_from
from modrob_cli.workflows.validate_long_result import Stretch
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_report import validation_page
from modrob_cli.workflows.validate_result import SCOPES, passed

MOST_ROWS = 200
"""Stretches that a table lists at most: the worst ones."""


class ThinnedCsv:
    """The series of a log with about so many rows: every k-th sample, and the worst one of each joint and stretch."""

    def __init__(self, robot: Robot, path: Path, count: int, rows: int) -> None:
        self.every = -(-count // rows)
        self._table = NumberCsv(path, series_header(robot))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, for people."""
        if self.every == 1:
            return ()
        return (f"the CSV file holds one sample of {self.every}, and the worst one of each joint in each stretch",)

    def __enter__(self) -> Self:
        """Open the file and write the header."""
        self._table.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._table.__exit__(kind, error, trace)

    def write(self, first: int, run: Run, bounds: TorqueBounds, used: Mask) -> None:
        """Write rows of a piece that begins with the sample ``first``."""
        kept = (first + np.arange(len(run.t))) % self.every == 0
        counted = np.flatnonzero(used)
        if len(counted):
            kept[counted[np.argmax(np.abs(run.tau - bounds.nominal)[counted], axis=0)]] = True
        self._table.write(series_rows(run, bounds, used)[kept])


class WorstStretch:
    """The stretch with the largest NRMSE of any joint so far, with its samples."""

    def __init__(self) -> None:
        self.stretch: Stretch | None = None
        self._samples: tuple[Run, TorqueBounds, Mask] | None = None

    def offer(self, stretch: Stretch, run: Run, bounds: TorqueBounds, used: Mask) -> None:
        """Keep it if it is worse."""
        if self.stretch is None or stretch.worst > self.stretch.worst:
            self.stretch, self._samples = stretch, (run, bounds, used)

    def judged(self, path: Path, log: JointLog) -> JudgedLog:
        """It as a log of its own, for drawing; ``log`` is any piece of the whole one.

        Raises
        ------
        NumericalError
            If there is none.
        """
        if self._samples is None:
            raise NumericalError("no samples are left to judge the model by; use a longer log or another --holdout")
        run, bounds, used = self._samples
        errors = prediction_errors(replace(run.signals, used=used), run.tau, bounds.nominal)
        inside = ((bounds.lower <= run.tau) & (run.tau <= bounds.upper))[used].mean(axis=0)
        item = LogRun(run, run, run, path, log)
        return JudgedLog(item, run, bounds, used, False, 0.0, None, errors, inside)


@dataclass(frozen=True)
class LongPage:
    """What a page about a long log takes beside the log.

    Attributes
    ----------
    name : of the page;  inputs : hash of each file that it was made from
    """

    name: str
    inputs: Mapping[str, str]


def write_details(
    robot: Robot, name: str, result: dict[str, Any], worst: JudgedLog, options: ValidateOptions, page: LongPage,
    folder: OutputFolder,
) -> None:  # fmt: skip
    """Write picture and page of a log; both show its worst stretch."""
    friction = friction_from(robot, options)
    times = worst.run.t[worst.used]
    where = f"the stretch with the largest NRMSE, {times[0]:.5g} s to {times[-1]:.5g} s"
    draw_log(robot, name, worst, friction, folder.stage(f"{name}.validate.png"), f"{where}; ")
    head = {"passed": passed([result], []), "friction": friction, "scope": SCOPES[friction]}
    report = validation_page(robot, worst, result, head, dict(page.inputs), options)
    joints, drawn = report.sections
    picture, table = _over_time(robot, result["stretches"], options)
    over_time = Section("Over the time of the log", (picture,))
    drawn = replace(drawn, title=f"Joint by joint: {where}")
    stretches = Section("Stretch by stretch", (table,), folded=True, on_paper=False)
    folder.write(page.name, render(replace(report, sections=(joints, over_time, drawn, stretches))))


def _over_time(robot: Robot, stretches: list[dict[str, Any]], options: ValidateOptions) -> tuple[Block, Block]:
    """NRMSE of each stretch, drawn and as a table."""
    edges = np.array([[stretch["start"], stretch["end"]] for stretch in stretches])
    ratios = [[joint["nrmse"] for joint in stretch["joints"]] for stretch in stretches]
    values = np.array(ratios, dtype=float)  # None becomes nan
    figure = stretch_figure(edges, values, robot.joint_names, "NRMSE")
    caption = (
        "NRMSE of each joint, stretch by stretch. A line that leaves its level shows drift, or a change of the arm."
    )
    picture = Picture(figure, caption, "NRMSE of each joint over the time of the log")
    size = np.nan_to_num(values, nan=np.inf).max(axis=1)
    shown = np.sort(np.argsort(-size, kind="stable")[:MOST_ROWS]).tolist()
    said = f"The worst {MOST_ROWS} of {len(stretches)} stretches" if len(stretches) > MOST_ROWS else "All stretches"
    rows: list[tuple[Cell, ...]] = []
    tones: dict[tuple[int, int], Tone] = {}
    for k in shown:
        for j, ratio in enumerate(ratios[k]):
            if options.max_nrmse is not None and (ratio is None or ratio > options.max_nrmse):
                tones[len(rows), 2 + j] = "bad"
        rows.append((*edges[k].tolist(), *ratios[k], min(joint["inside"] for joint in stretches[k]["joints"])))
    header = ("from [s]", "to [s]", *robot.joint_names, "inside, least")
    return picture, Table(header, tuple(rows), f"{said}: NRMSE of each joint; the smallest fraction inside.", tones)
