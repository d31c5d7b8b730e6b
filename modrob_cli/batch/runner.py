"""A run over many logs: locked, stoppable, resumable."""

import os
from collections.abc import Generator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from types import TracebackType
from typing import Self

from modrob_cli.batch.cluster import run_cluster
from modrob_cli.batch.jobs import BatchOptions, Listener, LogJob, LogTask, Outcome
from modrob_cli.batch.pool import run_pool
from modrob_cli.batch.settle import Context, settle
from modrob_cli.batch.stop import StopRequest, stoppable
from modrob_cli.errors import OutputError, OutputExistsError, StoppedError
from modrob_cli.io.folder_lock import FolderLock
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.staging import made_folder, staging_folder

_SHOWN = 5
_SECONDS_PER_BYTE, _SECONDS_PER_DRAWING, _START = 5e-7, 1.0, 2.0
_SHORT = 1_000_000
"""Rough work of a log, and work that makes another process worth its start; only to choose a number of processes."""


class BatchRun:
    """Holds the output folder while logs are worked on; a context manager.

    Everything is done inside the block, the results about all logs too, so that a signal at any time leaves whole files
    only and ends in one message.

    Raises
    ------
    UsageError
        If another run holds the folder.
    OutputError
        If results cannot be written.
    StoppedError
        If a signal stops the run.
    """

    def __init__(self, task: LogTask, out: Path, options: BatchOptions, overwrite: bool = False) -> None:
        self.task = task
        self.out = out
        self.options = options
        self.overwrite = overwrite
        self._staging = out / f".modrob-{task.command}"
        self._stack = ExitStack()
        self._done = self._wanted = 0

    def __enter__(self) -> Self:
        """Make and lock the folder, remove what an earlier run left unfinished."""
        with ExitStack() as stack:
            stack.enter_context(stoppable())
            stack.enter_context(made_folder(self.out))
            holder = f"modrob {self.task.command}"
            stack.enter_context(FolderLock(self.out / f".modrob-{self.task.command}.lock", holder))
            stack.enter_context(staging_folder(self._staging))
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the folder back; a signal becomes a message, and what stops the run says how to go on."""
        self._stack.__exit__(kind, error, trace)
        done = f"{self._done} of {self._wanted} logs are done, their results are in {self.out}"
        advice = f"{done}; the same command with --resume goes on from there"
        if isinstance(error, KeyboardInterrupt):
            number = error.number if isinstance(error, StopRequest) else 2
            raise StoppedError(f"stopped ({error or 'Interrupt'}): {advice}", number) from error
        if isinstance(error, OutputError) and self._done:
            raise OutputError(f"{error}: {advice}") from error

    def claim(self, jobs: Sequence[LogJob], overall: Sequence[str]) -> None:
        """Make sure that results may be written.

        Parameters
        ----------
        overall : names of the files about all logs

        Raises
        ------
        OutputExistsError
            If there are results already, unless they may be replaced or kept.
        """
        if self.overwrite or self.options.resume:
            return
        middle, names = f".{self.task.command}.", {job.name for job in jobs}
        found = [
            path.name for path in self.out.iterdir() if path.name in overall or path.name.rpartition(middle)[0] in names
        ]
        if found:
            listed = ", ".join(str(self.out / name) for name in sorted(found)[:_SHOWN])
            more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
            advice = "pass --resume to go on where a run has stopped, or --overwrite to replace it"
            raise OutputExistsError(f"{listed}{more}: exists already; {advice}")

    def settle(self, jobs: Sequence[LogJob], detailed: bool, listener: Listener | None = None) -> list[Outcome]:
        """Work on all logs.

        Parameters
        ----------
        detailed : also draw what is slow to draw
        listener : called with each outcome as it comes

        Returns
        -------
        outcomes : in the order of ``jobs``; if ``fail_fast`` is wanted and a log fails, only those that were done
        """
        staging, resume = self._staging, self.options.resume
        context = Context(self.task, self.out, staging, self.task.key(), resume, detailed)
        found: dict[str, Outcome] = {}
        self._done, self._wanted = 0, len(jobs)
        with closing(self._outcomes(jobs, context)) as outcomes:
            for outcome in outcomes:
                found[outcome.job.name] = outcome
                self._done += outcome.record is not None
                if listener is not None:
                    listener(outcome)
                if outcome.failure is not None and self.options.fail_fast:
                    break
        return [found[job.name] for job in jobs if job.name in found]

    def _outcomes(self, jobs: Sequence[LogJob], context: Context) -> Generator[Outcome]:
        if self.options.dask is not None:
            return run_cluster(jobs, context, self.options.dask)
        processes = self.options.processes or _worthwhile(jobs, context.detailed)
        if min(processes, len(jobs)) > 1:
            return run_pool(jobs, context, min(processes, len(jobs)))
        return (settle(job, context) for job in jobs)

    def outputs(self) -> OutputFolder:
        """Folder for the results about all logs."""
        return OutputFolder(self.out, overwrite=True, temporary=self._staging)


def _worthwhile(jobs: Sequence[LogJob], detailed: bool) -> int:
    """As many processes as there are cores, fewer where starting them would take longer than the work."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    each = _SECONDS_PER_DRAWING if detailed else 0.0
    work = sum(_SECONDS_PER_BYTE * _size(Path(job.source)) + each for job in jobs)
    return min(cores, 1 + int(work / _START))


def _size(path: Path) -> int:
    """Bytes of a file; of what is not here or has no size, such as a URL, those of a short log."""
    return path.stat().st_size if path.is_file() else _SHORT
