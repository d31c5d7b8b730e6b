"""MCAP files that are written piece by piece: what the mcap package finds in them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from modrob_cli.errors import ShapeError
from modrob_cli.io.mcap_writer import McapWriter, Series, write_mcap
from modrob_cli.io.ros_messages import joint_state

NAMES = ("a", "b")
LAYOUT = joint_state(NAMES)


def two_topics() -> list[Series]:
    rng = np.random.default_rng(1)
    stamps = 1_700_000_000_000_000_000 + np.arange(9000, dtype=np.int64) * 1_000_000
    return [
        Series("/one", LAYOUT, stamps, rng.normal(size=(9000, 6))),
        Series("/other", LAYOUT, stamps[::3] + 5, rng.normal(size=(3000, 6))),
    ]


def messages(path: Path) -> list[tuple[str, int, int, bytes]]:
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        return [(channel.topic, m.log_time, m.sequence, m.data) for _, channel, m in reader.iter_messages()]


def test_pieces_hold_the_messages_of_the_whole(tmp_path: Path) -> None:
    """Also pieces without messages of a topic, and without any."""
    series = two_topics()
    write_mcap(tmp_path / "whole.mcap", series)
    with McapWriter(tmp_path / "pieces.mcap", [(one.topic, one.layout) for one in series]) as writer:
        for edges in ((0, 1), (1, 2), (2, 2), (2, 8000), (8000, 9000)):
            ends = [int(series[0].stamps[0]) + 1_000_000 * edge for edge in edges]
            parts = []
            for one in series:
                first, last = np.searchsorted(one.stamps, ends).tolist()
                parts.append(replace(one, stamps=one.stamps[first:last], values=one.values[first:last]))
            writer.add(parts)
    assert messages(tmp_path / "pieces.mcap") == messages(tmp_path / "whole.mcap")
    with (tmp_path / "pieces.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.channel_message_counts == {1: 9000, 2: 3000}
    assert summary.statistics.message_start_time == series[0].stamps[0]
    assert summary.statistics.message_end_time == series[0].stamps[-1]


def test_what_does_not_follow_is_refused(tmp_path: Path) -> None:
    one, other = two_topics()
    topics = [(series.topic, series.layout) for series in (one, other)]
    with McapWriter(tmp_path / "log.mcap", topics) as writer:
        writer.add([one, other])
        with pytest.raises(ShapeError, match="begins before"):
            writer.add([one, other])
        with pytest.raises(ShapeError, match="expected series of the topics /one, /other"):
            writer.add([other, one])
    with pytest.raises(ShapeError, match="one series for each topic"):
        McapWriter(tmp_path / "log.mcap", [topics[0], topics[0]])


def test_a_file_without_messages_is_a_file(tmp_path: Path) -> None:
    with McapWriter(tmp_path / "empty.mcap", [("/one", LAYOUT)]):
        pass
    assert messages(tmp_path / "empty.mcap") == []
