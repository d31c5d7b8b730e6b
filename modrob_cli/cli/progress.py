"""Progress of long work, on a terminal only."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from modrob_cli.cli.quiet import QuietStream, stderr_console

T = TypeVar("T")


@contextmanager
def progress_bar(text: str) -> Iterator[Callable[[str, float], None]]:
    """Show a bar if there is somebody to see it; what is yielded takes what is done and the part that is done."""
    import sys

    if not QuietStream(sys.stderr).isatty():
        yield lambda what, fraction: None
        return
    from rich.progress import Progress

    with Progress(console=stderr_console(), transient=True) as progress:
        task = progress.add_task(text, total=1.0)
        yield lambda what, fraction: progress.update(task, description=what or text, completed=fraction)


def track(paths: Sequence[T], text: str = "Reading") -> Iterable[T]:
    """Go through files with a bar, if there is something to wait for and somebody to see it."""
    import sys

    if len(paths) < 2 or not QuietStream(sys.stderr).isatty():
        return paths
    from rich.progress import track as rich_track

    return rich_track(paths, text, console=stderr_console(), transient=True)
