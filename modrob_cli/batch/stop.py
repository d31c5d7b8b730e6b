"""Signals that end a run in order."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class StopRequest(KeyboardInterrupt):
    """A signal asked this process to end."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.strsignal(number))
        self.number = number


@contextmanager
def stoppable() -> Iterator[None]:
    """Turn SIGINT, SIGTERM and SIGHUP (a closed terminal) into :class:`StopRequest` inside the block.

    A signal that this process was told to ignore, as by nohup, stays ignored. Elsewhere than in the main thread nothing
    is changed.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        # A second one must not disturb the tidying up.
        for other in before:
            signal.signal(other, signal.SIG_IGN)
        raise StopRequest(number)

    before = {}
    if threading.current_thread() is threading.main_thread():
        wanted = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        before = {number: signal.getsignal(number) for number in wanted}
        before = {number: old for number, old in before.items() if old is not signal.SIG_IGN}
    try:
        for number in before:
            signal.signal(number, stop)
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)
