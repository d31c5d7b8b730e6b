"""Options of the commands that take many logs."""

from typing import TYPE_CHECKING, Annotated

import typer

from modrob_cli.errors import UsageError

if TYPE_CHECKING:
    from modrob_cli.batch.jobs import BatchOptions

_LOGS_HELP = (
    "MCAP or CSV files, folders (all *.mcap in and below), patterns in quotes ('runs/**/*.mcap'), URLs (s3://...), or "
    "@FILE with one of these per line."
)
Logs = Annotated[list[str], typer.Argument(metavar="LOG...", help=_LOGS_HELP, show_default=False)]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", metavar="N", min=1, help="Processes; else as many as there are cores."),
]
Resume = Annotated[
    bool,
    typer.Option("--resume", help="Go on where a run has stopped: results in DIR are kept unless something changed."),
]
KeepGoing = Annotated[
    bool,
    typer.Option("--keep-going/--fail-fast", help="What to do after a log that fails: the others, or stop at once."),
]
Dask = Annotated[
    str | None,
    typer.Option("--dask", metavar="ADDRESS", help="Work on this Dask cluster (tcp://HOST:8786, or a scheduler file)."),
]
Details = Annotated[
    int | None,
    typer.Option("--details", metavar="N", min=0, help="Of several logs, so many, the worst, get pages (else 10)."),
]


def batch_options(
    jobs: int | None, resume: bool, keep_going: bool, dask: str | None, details: int | None, overwrite: bool = False
) -> "BatchOptions":
    """How many logs are worked on, from the options above.

    Raises
    ------
    UsageError
        If they contradict one another.
    """
    from modrob_cli.batch.jobs import DETAILS, BatchOptions

    if resume and overwrite:
        raise UsageError("--resume keeps results and --overwrite replaces them; pass one of them")
    if dask is not None and jobs is not None:
        raise UsageError("--jobs is for this machine; with --dask the cluster's workers say how many there are")
    if dask is not None and not dask.strip():
        raise UsageError("--dask: found an empty address, expected one such as tcp://HOST:8786")
    return BatchOptions(jobs, resume, not keep_going, dask, DETAILS if details is None else details)
