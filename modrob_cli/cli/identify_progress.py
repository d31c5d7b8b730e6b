"""Progress of ``modrob identify``: log by log, then of the fit of all together."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from modrob_cli.cli.batch_progress import BatchListener, batch_progress
from modrob_cli.cli.progress import progress_bar


class IdentifyProgress:
    """Shows one bar after the other.

    Attributes
    ----------
    listener : of the logs
    """

    def __init__(self, total: int, stack: ExitStack) -> None:
        self._stack = stack
        self.listener: BatchListener = stack.enter_context(batch_progress("identify", total, measure))
        self._bar: Callable[[str, float], None] | None = None

    def stage(self, what: str, fraction: float) -> None:
        """Show what is done with all logs together, and which part of it is done."""
        if self._bar is None:
            self._stack.close()  # two bars would write over each other
            self._bar = self._stack.enter_context(progress_bar("All logs together"))
        self._bar(f"All logs together: {what}", fraction)


@contextmanager
def identify_progress(total: int) -> Iterator[IdentifyProgress]:
    """Show progress in the block; ``total`` is the number of logs."""
    with ExitStack() as stack:
        yield IdentifyProgress(total, stack)


def measure(record: dict[str, Any]) -> tuple[float, str]:
    """How bad a log is: NRMSE of its worst joint by its own fit, in words too."""
    if record["fit"] is None:
        reasons = any(note.startswith("no fit") for note in record["notes"])
        return (float("inf"), "no fit of its own") if reasons else (0.0, "read")
    errors = [(joint["name"], joint["holdout"] or joint["training"]) for joint in record["fit"]]
    ratios = [(error["nrmse"], name) for name, error in errors if error is not None and error["nrmse"] is not None]
    if not ratios:
        return float("inf"), "no torque recorded"
    worst, name = max(ratios)
    return worst, f"NRMSE {worst:.3f} ({name}), own fit"
