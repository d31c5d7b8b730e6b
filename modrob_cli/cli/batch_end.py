"""How a command over many logs ends."""

from collections.abc import Sequence
from typing import Any

_SHOWN = 20


def end_batch(skipped: Sequence[dict[str, Any]], negative: bool = False, against: Sequence[str] = ()) -> None:
    """Exit code and message of a run that has results.

    Parameters
    ----------
    skipped : logs without a result
    negative : whether the answer is no;  against : what speaks against a yes, worst first

    Raises
    ------
    FailedLogsError
        If logs have no result, or the answer is no.
    """
    from modrob_cli.errors import FailedLogsError, NegativeAnswerError
    from modrob_cli.workflows.batch_result import worst_code

    code = worst_code(skipped, NegativeAnswerError.exit_code if negative else 0)
    if not code:
        return
    lines = [*map(_reason, skipped), *against]
    more = [f"and {len(lines) - _SHOWN} more"] if len(lines) > _SHOWN else []
    raise FailedLogsError("\n".join(lines[:_SHOWN] + more), code)


def _reason(entry: dict[str, Any]) -> str:
    """Why there is no result, with the name of the log."""
    reason = str(entry["reason"])
    return reason if entry["log"] in reason else f"{entry['log']}: {reason}"
