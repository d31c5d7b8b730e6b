"""What the results about many logs have in common."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from modrob_cli import __version__
from modrob_cli.batch.jobs import LogJob, Outcome
from modrob_cli.io.log_sources import job_names
from modrob_cli.io.outputs import provenance


def jobs_of(sources: Sequence[str | Path], robot: str) -> list[LogJob]:
    """A job for each log; of several none is called like the robot, whose name the results about all of them bear."""
    texts = [str(source) for source in sources]
    names = job_names(texts, taken=() if len(texts) == 1 else (robot,))
    return [LogJob(name, text) for name, text in zip(names, texts, strict=True)]


def input_hashes(files: Sequence[Path]) -> dict[str, str]:
    """Hash of each file by its name."""
    found = provenance(list(files))["inputs"]
    return {str(name): str(value) for name, value in found.items()} if isinstance(found, dict) else {}


def skipped_entries(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Logs without a result: path, reason, and the exit code that it stands for."""
    return [
        {"log": outcome.job.label, "reason": outcome.failure.reason, "code": outcome.failure.code}
        for outcome in outcomes
        if outcome.failure is not None
    ]


def overall_provenance(inputs: dict[str, str], outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Version, and the hash of each input: logs by name, or as given where two share one."""
    done = [outcome for outcome in outcomes if outcome.record is not None]
    names = Counter([*inputs, *(outcome.job.file for outcome in done)])
    logs = {}
    for outcome in done:
        name = outcome.job.file
        logs[name if names[name] == 1 else outcome.job.label] = outcome.done["provenance"]["log"]
    return {"modrob": __version__, "inputs": {**inputs, **dict(sorted(logs.items()))}}


def all_files(common: Mapping[str, str], outcomes: Sequence[Outcome], command: str, out: Path) -> dict[str, str]:
    """Paths of all outputs by kind or name: those about all logs, then those of each.

    Parameters
    ----------
    common : names by kind; ``report`` is the page of the log itself where there is only one, if it has one
    """
    drawn = len(outcomes) > 1 or bool(outcomes[0].done["logs"][0]["page"])
    files = {kind: str(out / name) for kind, name in common.items() if kind != "report" or drawn}
    return files | log_files(outcomes, command, out, common.values())


def log_files(outcomes: Sequence[Outcome], command: str, out: Path, others: Iterable[str] = ()) -> dict[str, str]:
    """Paths of the files of each log by name, but for ``others``, which are listed elsewhere."""
    names: list[str] = []
    for outcome in outcomes:
        if outcome.record is not None:
            names += [f"{outcome.job.name}.{command}.json", *outcome.record["provenance"]["outputs"]]
    left_out = set(others)
    return {name: str(out / name) for name in names if name not in left_out}


def worst_code(skipped: Sequence[dict[str, Any]], otherwise: int = 0) -> int:
    """Exit code of a run: the lowest of those of its failures, and of what it would be without, 0 apart."""
    codes = [entry["code"] for entry in skipped] + ([otherwise] if otherwise else [])
    return min(codes, default=0)
