"""What is done with many logs, how, and what became of each."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from modrob_cli.io.log_sources import source_label, source_name
from modrob_cli.io.outputs import OutputFolder

DETAILS = 10
"""Of so many logs, the worst ones, a picture and a page are drawn unless told otherwise: drawing costs far more than
judging."""


@dataclass(frozen=True)
class LogJob:
    """One log.

    Attributes
    ----------
    name : unique; its files are NAME.COMMAND.json and so on
    source : path or URL as it was given
    """

    name: str
    source: str

    @property
    def label(self) -> str:
        """The source for people and records: of a URL without user and query, which may hold keys."""
        return source_label(self.source)

    @property
    def file(self) -> str:
        """Name of its file."""
        return source_name(self.source)


@dataclass(frozen=True)
class Failure:
    """Why there is no result.

    Attributes
    ----------
    reason : for people, maybe of several lines
    code : exit code that it stands for, as in :mod:`modrob_cli.errors`
    """

    reason: str
    code: int


@dataclass(frozen=True)
class Outcome:
    """What became of one log: a record or a failure.

    Attributes
    ----------
    record : plain data as in NAME.COMMAND.json
    kept : True if an earlier run made it and nothing has changed since
    seconds : that it took
    """

    job: LogJob
    record: dict[str, Any] | None
    failure: Failure | None = None
    kept: bool = False
    seconds: float = 0.0

    @property
    def done(self) -> dict[str, Any]:
        """The record of a log that did not fail."""
        if self.record is None:
            raise ValueError(f"{self.job.name} has no record")
        return self.record


Listener = Callable[[Outcome], None]
"""Called with each outcome as it comes, in the main process."""


@dataclass(frozen=True)
class TaskKey:
    """Everything but the log that decides its result.

    Attributes
    ----------
    inputs : hash by name of file: the robot and whatever else is read
    options : plain data
    """

    inputs: dict[str, str]
    options: dict[str, Any]


class LogTask(Protocol):
    """What is done with each log. Picklable; the same log gives the same bytes in any process."""

    @property
    def command(self) -> str:
        """Middle part of the names of all files: validate, identify, collision."""

    def key(self) -> TaskKey:
        """What decides the result; a record made under another key is stale."""

    def run(self, job: LogJob, path: Path, folder: OutputFolder, detailed: bool) -> dict[str, Any]:
        """Work on one log.

        Parameters
        ----------
        path : of the log, a local file
        folder : for all files of this log but the record
        detailed : also draw what is slow to draw

        Returns
        -------
        record : plain data; the caller adds ``provenance`` and writes it last

        Raises
        ------
        ModrobError
            If there is no result; the other logs go on.
        """


@dataclass(frozen=True)
class BatchOptions:
    """How many logs are worked on.

    Attributes
    ----------
    processes : None for as many as there are cores, fewer for little work
    resume : keep results of an earlier run that are not stale
    fail_fast : stop at the first log without a result
    dask : address (or scheduler file) of a Dask cluster that does the work
    details : so many logs, the worst, get pictures and pages of their own
    """

    processes: int | None = None
    resume: bool = False
    fail_fast: bool = False
    dask: str | None = None
    details: int = DETAILS
