"""One bar for all logs, drawn by rich."""

from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from modrob_cli.cli.batch_tally import Tally, counts, duration, per_second
from modrob_cli.cli.quiet import QuietStream

if TYPE_CHECKING:
    from rich.console import RenderableType

_PER_SECOND = 8


class BatchBar:
    """A bar with counts, speed and time left at the foot of a terminal, gone at the end; lines stay above it.

    It is drawn by a thread of its own some times a second, whatever the number of logs.
    """

    def __init__(self, command: str, tally: Tally, stream: QuietStream) -> None:
        from rich.console import Console
        from rich.live import Live

        file: Any = stream
        self._command = command
        self._tally = tally
        self._console = Console(file=file, force_terminal=True, highlight=False)
        self._live = Live(
            get_renderable=self._draw,
            console=self._console,
            refresh_per_second=_PER_SECOND,
            transient=True,
            redirect_stdout=False,
        )

    def __enter__(self) -> Self:
        """Show it."""
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove it."""
        self._live.stop()

    def say(self, line: str) -> None:
        """Print a line above the bar."""
        from rich.text import Text

        self._console.print(Text(line), soft_wrap=True)

    def _draw(self) -> "RenderableType":
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        tally = self._tally
        words = [f"{tally.done}/{tally.total}", per_second(tally.speed), duration(tally.seconds), self._rest()]
        grid = Table.grid(padding=(0, 1), expand=True)
        grid.add_column(no_wrap=True)
        grid.add_column(ratio=1)
        for _ in words:
            grid.add_column(no_wrap=True)
        bar = ProgressBar(total=max(tally.total, 1), completed=tally.done)
        grid.add_row(Text(self._command), bar, *(Text(word) for word in words))
        below = Text(", ".join(counts(tally)), no_wrap=True, overflow="ellipsis")
        return Group(grid, below) if below else grid

    def _rest(self) -> str:
        tally = self._tally
        if tally.done >= tally.total:
            return f"pages: {tally.repeated}" if tally.repeated else "report"
        return f"{duration(tally.left)} left" if tally.left is not None else ""
