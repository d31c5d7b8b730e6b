"""Files of one log, written while it is judged: table and MCAP in the unit of the log."""

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from modrob_cli.identify.effort import effort_factors
from modrob_cli.io.mcap_writer import McapWriter, Series
from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.workflows.collision_judge import JudgedStretch
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_stream import RunStream

MOST_ROWS, MOST_OUTSIDE = 20_000, 500_000
"""Rows of the table of a log: of a longer one every k-th sample and, up to a limit, all outside the band; the MCAP file
has all."""
TOPICS = {"measured": "/collision/measured", "lower": "/collision/lower", "upper": "/collision/upper"}


class SeriesFiles:
    """Writes filtered measurement and band of each stretch; a context manager.

    Parameters
    ----------
    table, mcap : files; the latter has joint states with efforts at the times of the log, for PlotJuggler and Foxglove
    """

    def __init__(self, stream: RunStream, options: CollisionOptions, table: Path, mcap: Path) -> None:
        robot = stream.about.robot
        self._kinds = list(TOPICS) if stream.about.tau is not None else ["lower", "upper"]
        self._factors = effort_factors(robot, options.effort)
        self._layout = joint_state(robot.joint_names, position=False, velocity=False)
        self._outside = 0
        self._step = -(-stream.survey.samples // MOST_ROWS)
        header = ["t", "used", *(f"{name}.{kind}" for name in robot.joint_names for kind in self._kinds)]
        self._table = NumberCsv(table, header)
        self._mcap = McapWriter(mcap, [(TOPICS[kind], self._layout) for kind in self._kinds])
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Open both files."""
        with ExitStack() as stack:
            stack.enter_context(self._table)
            stack.enter_context(self._mcap)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close them."""
        self._stack.__exit__(kind, error, trace)

    def add(self, judged: JudgedStretch) -> None:
        """Write the next stretch."""
        run = judged.run
        values = [getattr(judged.band, kind) / self._factors for kind in self._kinds]
        stamps = run.start + np.round(run.motion.t * 1e9).astype(np.int64)
        self._mcap.add(
            [Series(TOPICS[kind], self._layout, stamps, part) for kind, part in zip(self._kinds, values, strict=True)]
        )
        keep = (judged.first + np.arange(len(stamps))) % self._step == 0
        outside = (judged.excess != 0.0).any(axis=1)
        if self._outside <= MOST_OUTSIDE:
            keep |= outside
        self._outside += int(np.count_nonzero(outside))
        series = np.stack([part[keep] for part in values], axis=-1)
        self._table.write(np.column_stack([run.motion.t[keep], run.used[keep], series.reshape(len(series), -1)]))
