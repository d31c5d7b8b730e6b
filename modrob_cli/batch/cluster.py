"""Logs shared among the workers of a Dask cluster; results come back as bytes and are written here."""

import logging
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

from modrob_cli import __version__
from modrob_cli.batch.jobs import Failure, LogJob, Outcome
from modrob_cli.batch.settle import BUG, Context, attempt, earlier, elsewhere
from modrob_cli.errors import OutputError, UsageError
from modrob_cli.io.outputs import OutputFolder, read_files

AHEAD = 3
"""Logs on their way for each thread of the cluster: enough to keep it busy, few enough for the memory here."""
PATIENCE = 30
"""Time to find the scheduler, [s]."""

_ONE_AT_A_TIME = Lock()


def run_cluster(jobs: Sequence[LogJob], context: Context, address: str) -> Generator[Outcome]:
    """Outcomes in the order in which they come.

    Each log is one task. A worker that is lost loses nothing: its logs go to others. Workers read the logs from the
    paths or URLs as they are given, so they have to see them; they need not see the output folder.

    Raises
    ------
    UsageError
        If ``dask.distributed`` is not installed, the scheduler is not there or goes away, or workers have another
        version of modrob.
    OutputError
        If results cannot be written.
    """
    try:
        from distributed import KilledWorker
    except ImportError as error:
        raise UsageError("--dask needs dask.distributed: pip install 'modrob[dask]'") from error
    there, suspects = replace(context, base=Path.cwd()), []
    with _quiet(), _client(address) as client:
        _check_versions(client, address)
        for future, job in _futures(client, jobs, there, AHEAD * max(sum(client.nthreads().values()), 1)):
            if isinstance(future.exception(), KilledWorker):
                suspects.append(job)
            else:
                yield _collect(future, job, context, address)
        # A log that kills its workers brings those that wait there under suspicion; alone each shows what it is.
        for future, job in _futures(client, suspects, there, 1):
            yield _collect(future, job, context, address)


def _futures(client: Any, jobs: Sequence[LogJob], context: Context, ahead: int) -> Iterator[tuple[Any, LogJob]]:
    """Submit all, ``ahead`` at a time; what is done, with its job."""
    from distributed import as_completed

    waiting, sent = deque(jobs), {}
    done = as_completed(loop=client.loop)

    def send() -> None:
        if waiting:
            job = waiting.popleft()
            future = client.submit(work_remotely, job, context, earlier(job, context), pure=False)
            sent[future] = job
            done.add(future)

    for _ in range(ahead):
        send()
    for future in done:
        yield future, sent.pop(future)
        send()


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the messages of libraries, which tell of lost connections at length; what matters is told here."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _client(address: str) -> Any:
    from distributed import Client

    where = {"scheduler_file": address} if Path(address).is_file() else {"address": address}
    try:
        return Client(**where, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        message = f"--dask {address}: found no scheduler there ({error}); start one with: dask scheduler"
        raise UsageError(message) from error


def _check_versions(client: Any, address: str) -> None:
    if not client.nthreads():
        raise UsageError(f"--dask {address}: the scheduler has no workers; start some with: dask worker {address}")
    try:
        found = client.run(installed_version)
    except Exception as error:  # what a worker cannot load comes as an error of any kind
        message = f"modrob cannot be used on the workers ({error}); install modrob {__version__} there"
        raise UsageError(f"--dask {address}: {message}") from error
    other = {worker: version for worker, version in found.items() if version != __version__}
    if other:
        worker, version = next(iter(other.items()))
        raise UsageError(f"--dask {address}: {worker} has modrob {version}, here it is {__version__}; install the same")


def installed_version() -> str:
    """Version of modrob where this runs."""
    return __version__


def work_remotely(job: LogJob, context: Context, known: dict[str, Any] | None) -> tuple[Outcome, dict[str, bytes]]:
    """Work on one log on a worker; also the files that came out of it, the record last.

    Raises
    ------
    OutputError
        If the worker cannot write temporary files.
    """
    # Threads of one worker take turns: drawing is not made for threads, and linear algebra counts its own.
    with _ONE_AT_A_TIME, TemporaryDirectory(prefix="modrob-") as folder:
        outcome = attempt(job, elsewhere(context, Path(folder)), known)
        if outcome.record is None or outcome.kept:
            return outcome, {}
        names = [*outcome.record["provenance"]["outputs"], f"{job.name}.{context.task.command}.json"]
        return outcome, read_files(Path(folder), names)


def _collect(future: Any, job: LogJob, context: Context, address: str) -> Outcome:
    """Write what a worker made."""
    if future.status in ("cancelled", "lost"):
        raise UsageError(f"--dask {address}: the scheduler went away; with --resume the same command goes on")
    try:
        outcome, files = future.result()
    except OutputError as error:
        return Outcome(job, None, Failure(f"{job.label}: on its worker: {error}", error.exit_code))
    except Exception as error:  # KilledWorker and whatever else the cluster has to say
        reason = f"{job.label}: lost on the cluster, {type(error).__name__}: {error}"
        return Outcome(job, None, Failure(reason, BUG))
    with OutputFolder(context.out, overwrite=True, temporary=context.staging) as folder:
        for name, content in files.items():
            folder.write(name, content)
    found: Outcome = outcome
    return found
