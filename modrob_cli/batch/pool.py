"""Logs shared among processes of this machine."""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from modrob_cli.batch.jobs import Failure, LogJob, Outcome
from modrob_cli.batch.settle import BUG, Context, settle
from modrob_cli.errors import OutputError

AHEAD = 2
"""Logs that a process has at a time: one that it works on, one that waits, so that it never does."""


@dataclass
class _Worker:
    process: BaseProcess
    pipe: Any
    jobs: deque[LogJob] = field(default_factory=deque)


def run_pool(jobs: Sequence[LogJob], context: Context, processes: int) -> Generator[Outcome]:
    """Outcomes in the order in which they come.

    A process that dies takes the log that it was working on with it, not the others. All processes are gone when the
    generator ends or is closed; none outlives this process.

    Raises
    ------
    OutputError
        If results cannot be written.
    """
    waiting = deque(jobs)
    workers = [_hire(context) for _ in range(processes)]
    try:
        for worker in workers:
            _feed(worker, waiting)
        while any(worker.jobs for worker in workers):
            ready = wait([worker.pipe for worker in workers if worker.jobs])
            for k, worker in enumerate(workers):
                if worker.pipe not in ready:
                    continue
                try:
                    found = worker.pipe.recv()
                except (EOFError, OSError):
                    yield _lost(worker, waiting)
                    workers[k] = worker = _hire(context)
                else:
                    if isinstance(found, OutputError):
                        raise found
                    worker.jobs.popleft()
                    yield found
                _feed(worker, waiting)
    finally:
        _dismiss(workers)


def _hire(context: Context) -> _Worker:
    methods = multiprocessing.get_all_start_methods()
    # Not forked from this process, which has threads (progress bars, linear algebra) and locks.
    system: Any = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
    if "forkserver" in methods:
        system.set_forkserver_preload([__name__, type(context.task).__module__])
    ours, theirs = system.Pipe()
    process = system.Process(target=_serve, args=(theirs, context), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process, ours)


def _feed(worker: _Worker, waiting: deque[LogJob]) -> None:
    while waiting and len(worker.jobs) < AHEAD:
        job = waiting.popleft()
        worker.jobs.append(job)
        try:
            worker.pipe.send(job)
        except OSError:
            return  # it has died, which the next look at its pipe finds


def _lost(worker: _Worker, waiting: deque[LogJob]) -> Outcome:
    """The first log of a dead process is to blame; the others wait again."""
    worker.process.join()
    blamed, *others = worker.jobs
    waiting.extendleft(reversed(others))
    code = worker.process.exitcode or 0
    how = f"signal {-code}, {signal.strsignal(-code)}" if code < 0 else f"exit code {code}"
    advice = "perhaps memory ran out; fewer processes (--jobs 1) need less"
    return Outcome(blamed, None, Failure(f"{blamed.label}: the process that read it died ({how}); {advice}", BUG))


def _dismiss(workers: Sequence[_Worker]) -> None:
    for worker in workers:
        worker.pipe.close()
        if worker.jobs:
            worker.process.kill()
    for worker in workers:
        worker.process.join()


def _serve(pipe: "Connection[Outcome | OutputError, LogJob]", context: Context) -> None:
    """What a process does until nobody sends any more."""
    # The main process decides what an interruption from the keyboard means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            job = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            found: Outcome | OutputError = settle(job, context)
        except OutputError as error:
            found = error
        pipe.send(found)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
    os.kill(os.getpid(), signal.SIGKILL)
