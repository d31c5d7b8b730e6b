"""When a log was recorded."""

from datetime import UTC, datetime

FIRST_YEAR = 2001
"""Stamps before it come from a clock that does not know the date; our own simulations begin with the year 2000."""


def log_date(start: int | None) -> str | None:
    """Time of a log's first sample as ISO 8601 in UTC, whole seconds; None if its stamps tell no date.

    Parameters
    ----------
    start : stamp of the first sample, [ns] since 1970; None if nothing tells
    """
    if start is None:
        return None
    first = int(datetime(FIRST_YEAR, 1, 1, tzinfo=UTC).timestamp())
    if start // 1_000_000_000 < first:
        return None
    return datetime.fromtimestamp(start // 1_000_000_000, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
