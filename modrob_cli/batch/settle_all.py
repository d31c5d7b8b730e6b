"""All logs, and then pictures and pages of the worst of them."""

from collections.abc import Callable, Sequence
from typing import Any

from modrob_cli.batch.jobs import Listener, LogJob, Outcome
from modrob_cli.batch.runner import BatchRun
from modrob_cli.errors import FailedLogsError

Measure = Callable[[dict[str, Any]], float]
"""How bad a record is; the worst logs get pictures and pages."""


def settle_all(
    run: BatchRun, jobs: Sequence[LogJob], measure: Measure, listener: Listener | None = None
) -> list[Outcome]:
    """Outcomes of all logs, in their order.

    Raises
    ------
    FailedLogsError
        If no log has a result, with the reasons of all; or, with ``fail_fast``, at the first without.
    """
    few = len(jobs) <= run.options.details
    outcomes = run.settle(jobs, few, listener)
    failed = [outcome for outcome in outcomes if outcome.failure is not None]
    if failed and (run.options.fail_fast or len(failed) == len(jobs)):
        raise failures_as_error(failed)
    if few:
        return outcomes
    done = [outcome for outcome in outcomes if outcome.record is not None]
    worst = sorted(done, key=lambda outcome: measure(outcome.done), reverse=True)[: run.options.details]
    drawn = {outcome.job: outcome for outcome in run.settle([outcome.job for outcome in worst], True, listener)}
    return [drawn.get(outcome.job, outcome) for outcome in outcomes]


def failures_as_error(outcomes: Sequence[Outcome]) -> FailedLogsError:
    """Reasons of all failures, of which there is one at least."""
    failures = [outcome.failure for outcome in outcomes if outcome.failure is not None]
    code = min(failure.code for failure in failures)
    return FailedLogsError("\n".join(failure.reason for failure in failures), code)
