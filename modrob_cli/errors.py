"""Errors that reach the user, each with its own exit code.

Exit codes: 0 done and the verdict is positive; 1 a bug; 2 wrong usage; 3 bad input file; 4 the tool worked
and the answer is no; 5 numerical failure; 6 an output exists already; 128 + n stopped by signal n.
"""

from collections.abc import Iterable
from dataclasses import dataclass


class ModrobError(Exception):
    """Root of all errors that are reported without a traceback."""

    exit_code: int = 1


class UsageError(ModrobError):
    """Options or arguments that do not fit together."""

    exit_code = 2


class OutputError(UsageError):
    """Outputs cannot be written: no space, no permission; another log would fare no better."""


class StoppedError(ModrobError):
    """Somebody stopped the run; the exit code is that of the shell, 128 and the number of the signal."""

    def __init__(self, message: str, signal: int) -> None:
        super().__init__(message)
        self.exit_code = 128 + signal


class FailedLogsError(ModrobError):
    """Logs of which there is no result, each with its reason; the exit code is that of the worst."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code


@dataclass(frozen=True)
class Fault:
    """One thing wrong with one input file.

    Attributes
    ----------
    file : path of the file, as the user would write it
    line, column : counted from 1; None where the fault has no place in the text
    path : place inside the document, e.g. ``$.body.mass``; "" where there is none
    message : what was found, what was expected, what to do
    """

    file: str
    message: str
    path: str = ""
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        """Format as ``file:line:column: path: message``."""
        place = self.file
        if self.line is not None:
            place += f":{self.line}" + (f":{self.column}" if self.column is not None else "")
        return printable(": ".join(part for part in (place, self.path, self.message) if part))


def printable(text: str) -> str:
    """Escape what is not printable (control characters, lone surrogates), so that no input reaches a terminal raw."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class InputFileError(ModrobError):
    """An input file is missing, malformed or does not fit its schema.

    Carries every fault that was found, not only the first one.
    """

    exit_code = 3

    def __init__(self, faults: Fault | Iterable[Fault]) -> None:
        self.faults = (faults,) if isinstance(faults, Fault) else tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


class NegativeAnswerError(ModrobError):
    """The tool worked and the answer is no."""

    exit_code = 4


class NumericalError(ModrobError):
    """A computation failed: ill-conditioned, no convergence, result out of range."""

    exit_code = 5


class ShapeError(NumericalError):
    """An array does not have the shape that a function asks for."""


class OutputExistsError(ModrobError):
    """An output file exists and overwriting was not allowed."""

    exit_code = 6
