"""Faults of documents that validators find, each at its own place."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError


@dataclass(frozen=True)
class LocatedFault:
    """What is wrong at a place below the validated value.

    Attributes
    ----------
    place : keys and indices;  message : starts with ``Input should``;  found : the value there
    """

    place: tuple[str | int, ...]
    message: str
    found: Any


def raise_faults(title: str, faults: Iterable[LocatedFault]) -> None:
    """Raise all faults at once, if there are any; for use in validators.

    Raises
    ------
    ValidationError
        With one entry for each fault.
    """
    details = [
        InitErrorDetails(
            type=PydanticCustomError("fault", "{message}", {"message": fault.message}),  # no template in the message
            loc=fault.place,
            input=fault.found,
        )
        for fault in faults
    ]
    if details:
        raise ValidationError.from_exception_data(title, details)
