"""Text for people, written to a stream that may go away: then the work goes on in silence."""

import os
from typing import Any, TextIO


def silence(stream: TextIO) -> None:
    """Send everything that is written from now on nowhere, by whomever.

    What a buffer still holds then goes there too, so that the end of the process does not stumble over it.
    """
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
    except (OSError, ValueError):  # no file behind it
        return


class QuietStream:
    """A stream that falls silent when nobody takes what it writes (closed pipe or terminal, full disk)."""

    def __init__(self, stream: TextIO | None) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write, or drop the text."""
        stream = self._stream
        if stream is not None:
            try:
                stream.write(text)
            except (OSError, ValueError):
                self._give_up()
        return len(text)

    def flush(self) -> None:
        """Pass on what is waiting, or drop it."""
        stream = self._stream
        if stream is not None:
            try:
                stream.flush()
            except (OSError, ValueError):
                self._give_up()

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        try:
            return self._stream is not None and self._stream.isatty()
        except ValueError:  # closed
            return False

    def __getattr__(self, name: str) -> Any:
        """Anything else as the stream has it, such as its encoding."""
        return getattr(self._stream, name)

    def _give_up(self) -> None:
        if self._stream is not None:
            silence(self._stream)
        self._stream = None


def stderr_console() -> Any:
    """A console of rich on stderr that survives the end of its terminal."""
    import sys

    from rich.console import Console

    file: Any = QuietStream(sys.stderr)
    return Console(file=file)
