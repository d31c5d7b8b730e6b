"""The joint states of one topic of an MCAP file, through a temporary file instead of memory."""

from collections.abc import Sequence
from pathlib import Path

from modrob_cli.io.joint_reader import JointReader
from modrob_cli.io.joint_series import JointSeries
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.long_series import LongSeries


class LongReader(JointReader):
    """One pass over an MCAP file; rules and errors are those of :class:`JointReader`."""

    def __init__(self, path: Path, wanted: Sequence[str], options: LogOptions, window: int) -> None:
        super().__init__(path, wanted, options)
        self.window = window
        self._long: dict[str, LongSeries] = {}

    def read_long(self) -> tuple[LongSeries, list[str]] | None:
        """Samples in a file, which is the caller's to close, and notes; None if joints are spread over messages."""
        try:
            topic, names, losses = self._collect()
            series = self._long[topic]
            series.finish()
            if not series.spread:
                found = series, self._check(series, names, losses)
                del self._long[topic]
                return found
            return None
        finally:
            for topic in list(self._long):
                self._give_up(topic)

    def _check(self, series: LongSeries, names: tuple[str, ...], losses: list[str]) -> list[str]:
        contradiction = series.publishers.conflict()
        if contradiction and self.options.publisher is None:
            numbers = series.numbers
            counts = {source: series.used[source] for source in numbers if source in series.used}
            self._raise_publishers(contradiction, counts, numbers)
        try:
            notes = [*losses, *self._ignored(series), *series.order.notes()]
        except ValueError as error:
            self._raise(str(error))
        notes += self._repeated(series.completeness.samples, series.order.repeated)
        return [*notes, *series.completeness.notes(self.path, names)]

    def _new_series(self, topic: str) -> JointSeries:
        self._long[topic] = LongSeries(self.wanted or (), self.options, self.topics, self.window)
        return self._long[topic]

    def _give_up(self, topic: str) -> None:
        super()._give_up(topic)
        if topic in self._long:
            self._long.pop(topic).close()
