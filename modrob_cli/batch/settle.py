"""One log: kept from an earlier run, or worked on; its files appear whole, its record last."""

import json
import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from modrob_cli import __version__
from modrob_cli.batch.jobs import Failure, LogJob, LogTask, Outcome, TaskKey
from modrob_cli.errors import Fault, InputFileError, ModrobError, OutputError
from modrob_cli.io.log_record import key_digest, read_record, record_text
from modrob_cli.io.log_sources import local_copy
from modrob_cli.io.outputs import OutputFolder, sha256

BUG = 1


@dataclass(frozen=True)
class Context:
    """What all logs of a run have in common; picklable.

    Attributes
    ----------
    out, staging : folder for the results; for temporary files on the same disk
    key : of the task, made once
    resume : keep what is not stale
    detailed : also draw what is slow to draw
    base : folder that relative paths of logs start from; empty for the current one
    """

    task: LogTask
    out: Path
    staging: Path
    key: TaskKey
    resume: bool
    detailed: bool
    base: Path = Path()

    def path(self, job: LogJob) -> str:
        """Where a log is read; URLs stay as they are."""
        return job.source if "://" in job.source else str(self.base / job.source)

    def digest(self, job: LogJob) -> str:
        """Digest of everything but the log's content that decides its record."""
        options = {"command": self.task.command, "source": job.label, "options": self.key.options}
        return key_digest({**options, "inputs": self.key.inputs})


def settle(job: LogJob, context: Context) -> Outcome:
    """Do the work for one log, or find it done.

    Raises
    ------
    OutputError
        If results cannot be written; every other failure is part of the outcome.
    """
    return attempt(job, context, earlier(job, context))


def earlier(job: LogJob, context: Context) -> dict[str, Any] | None:
    """The record of an earlier run, if it is to be kept and the log is still the same (which is not looked at here)."""
    if not context.resume:
        return None
    record = read_record(context.out, f"{job.name}.{context.task.command}.json", context.digest(job))
    if record is None or (context.detailed and not record["provenance"].get("detailed")):
        return None
    return record


def attempt(job: LogJob, context: Context, known: dict[str, Any] | None) -> Outcome:
    """Work on a log unless ``known`` was made from the same content; parameters and errors as for :func:`settle`."""
    from threadpoolctl import threadpool_limits

    start = time.perf_counter()
    record, failure, kept = None, None, False
    path = Path(context.path(job))
    try:
        # One thread for linear algebra: sums come out the same wherever a log is worked on, and processes share cores.
        with threadpool_limits(limits=1), local_copy(context.path(job)) as path:
            digest = _digest(path, job)
            kept = known is not None and known["provenance"]["log"] == digest
            record = known if kept else _work(job, context, path, digest)
    except OutputError as error:
        raise OutputError(str(error).replace(str(context.staging), str(context.out))) from error
    except ModrobError as error:
        # Errors name the file that was read; people know it by the name that they gave.
        failure = Failure(str(error).replace(str(path), job.label).replace(job.source, job.label), error.exit_code)
    except MemoryError:
        failure = Failure(f"{job.label}: there is not enough memory for it", InputFileError.exit_code)
    except Exception as error:  # a bug, which must not cost the results of the other logs
        failure = Failure(f"{job.label}: {_where(error)}", BUG)
    return Outcome(job, record, failure, kept, time.perf_counter() - start)


def _digest(path: Path, job: LogJob) -> str:
    try:
        return f"sha256:{sha256(path)}"
    except OSError as error:
        raise InputFileError(Fault(job.source, f"cannot be read: {error.strerror or error}")) from error


def _work(job: LogJob, context: Context, path: Path, digest: str) -> dict[str, Any]:
    with OutputFolder(context.out, overwrite=True, temporary=context.staging) as folder:
        record = context.task.run(job, path, folder, context.detailed)
        made = {
            "modrob": __version__,
            "inputs": {**context.key.inputs, job.file: digest},
            "log": digest,
            "key": context.digest(job),
            "detailed": context.detailed,
            "outputs": folder.hashes(),
        }
        record = {**record, "provenance": made}
        # The last to be renamed: where it is, everything else is.
        text = record_text(record)
        folder.write(f"{job.name}.{context.task.command}.json", text)
    # As read back from its file, so that a record that is kept later looks the same.
    found: dict[str, Any] = json.loads(text)
    return found


def _where(error: BaseException) -> str:
    """A bug in one line, for a report to the makers."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"internal error, {type(error).__name__}: {error}{place}"


def elsewhere(context: Context, folder: Path) -> Context:
    """The same work with results in another folder, as on a machine that does not see the first."""
    return replace(context, out=folder, staging=folder)
