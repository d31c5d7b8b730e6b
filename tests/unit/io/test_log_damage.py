"""Damaged and truncated MCAP files: what can be read is read, what was lost is said, nothing else goes wrong."""

import struct
import time
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest

from modrob_cli.errors import InputFileError
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_reader import read_recording
from modrob_cli.model.log import Recording
from tests.mcap_samples import JOINT_STATE, Form, cdr_topic, joint_state, write_topics

COUNT = 200
FORMS = {
    "zstd": Form("ZSTD", 2048),
    "lz4": Form("LZ4", 2048),
    "no compression": Form("NONE", 2048),
    "no chunks": Form("NONE", chunked=False, data_checksum=True),
}
STRICT = LogOptions(strict=True)


def sample(path: Path, form: Form, count: int = COUNT) -> Path:
    rng = np.random.default_rng(1)
    rows = [
        joint_state(5.0 + 0.01 * k, ("a", "b"), np.sin(0.01 * k + np.arange(2)), rng.normal(size=2), rng.normal(size=2))
        for k in range(count)
    ]
    topic = cdr_topic("/joint_states", JOINT_STATE, rows)
    # As a recorder does: the log time is a little after the stamp.
    topic.messages = [(5_002_000_000 + 10_000_000 * k, data) for k, (_, data) in enumerate(topic.messages)]
    return write_topics(path, [topic], form)


def table(recording: Recording) -> dict[int, list[float]]:
    assert recording.dq is not None
    assert recording.effort is not None
    rows = np.hstack([recording.q, recording.dq, recording.effort]).tolist()
    return dict(zip(recording.stamps.tolist(), rows, strict=True))


def records(raw: bytes | bytearray) -> list[tuple[int, int, int]]:
    """Opcode, place and length of the records of a file, by the specification."""
    out, place = [], 8
    while place < len(raw) - 8:
        opcode, length = struct.unpack_from("<BQ", raw, place)
        out.append((opcode, place, length))
        place += 9 + length
    return out


def chunks(raw: bytes | bytearray) -> list[tuple[int, int]]:
    """Place and length (with opcode and length) of the chunks of a file."""
    return [(place, 9 + length) for opcode, place, length in records(raw) if opcode == 6]


@pytest.mark.parametrize("form", list(FORMS))
def test_files_cut_anywhere(tmp_path: Path, form: str) -> None:
    good = sample(tmp_path / "good.mcap", FORMS[form])
    raw, expected = good.read_bytes(), table(read_recording(good))
    rng = np.random.default_rng(2)
    path, refused = tmp_path / "cut.mcap", [0]
    for cut in rng.integers(len(raw), size=200):
        path.write_bytes(raw[:cut])
        plain = sum(9 + length <= cut - place for opcode, place, length in records(raw) if opcode == 5)
        try:
            found = read_recording(path)
        except InputFileError:
            refused.append(plain)
            continue
        rows = table(found)
        assert list(rows) == list(expected)[: len(rows)]
        assert all(expected[stamp] == row for stamp, row in rows.items())
        assert len(rows) >= plain
        assert "damaged: the file ends in the middle: it was cut" in found.notes[0]
        with pytest.raises(InputFileError, match="--strict refuses a file that is damaged"):
            read_recording(path, options=STRICT)
    assert max(refused) < 2  # whole messages that were there
    assert len(refused) < 40


def test_the_beginning_of_a_cut_chunk_is_used(tmp_path: Path) -> None:
    good = sample(tmp_path / "good.mcap", Form("NONE", chunk_size=10**6))
    raw = good.read_bytes()
    ((place, length),) = chunks(raw)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(raw[: place + length // 2])
    # A message takes length / COUNT bytes; half of the chunk holds half of them, the one that is cut left out.
    assert abs(len(read_recording(cut).stamps) - COUNT / 2) < 3


@pytest.mark.parametrize("form", list(FORMS))
def test_files_with_a_flipped_byte(tmp_path: Path, form: str) -> None:
    good = sample(tmp_path / "good.mcap", FORMS[form])
    raw, expected = good.read_bytes(), table(read_recording(good))
    rng = np.random.default_rng(3)
    path = tmp_path / "bad.mcap"
    for place in rng.integers(len(raw), size=200):
        flipped = bytearray(raw)
        flipped[place] ^= int(rng.integers(1, 256))
        path.write_bytes(flipped)
        try:
            found = read_recording(path)
        except InputFileError:
            assert form == "no chunks" or place < 64  # the mark at the beginning; without chunks one record may be all
            continue
        rows = table(found)
        if form == "no chunks":
            # One checksum covers all: it says that something is wrong, not what.
            assert found.notes
            continue
        assert all(expected[stamp] == row for stamp, row in rows.items())
        assert found.notes or rows == expected
        if found.notes:
            with pytest.raises(InputFileError, match="--strict refuses"):
                read_recording(path, options=STRICT)


def test_a_lost_chunk_is_described_and_the_others_are_read(tmp_path: Path) -> None:
    good = sample(tmp_path / "good.mcap", Form("ZSTD"))
    raw, expected = bytearray(good.read_bytes()), table(read_recording(good))
    place, length = chunks(raw)[1]
    raw[place + length - 20] ^= 0x55
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(raw)
    found = read_recording(bad)
    (note,) = found.notes
    lost = COUNT - len(found.stamps)
    assert lost > 10
    assert all(expected[stamp] == row for stamp, row in table(found).items())
    # The lost messages follow one another; a message every 10 ms.
    gap = int(np.argmax(np.diff(found.stamps)))
    assert np.diff(found.stamps)[gap] == (lost + 1) * 10_000_000
    assert f"at byte {place}: " in note
    assert f"lost: {lost} messages, {length} bytes, from {(gap + 1) / 100:g} s to {(gap + lost) / 100:g} s" in note


def test_the_first_chunk_is_lost_with_the_definitions_in_it(tmp_path: Path) -> None:
    """The summary repeats them."""
    raw = bytearray(sample(tmp_path / "good.mcap", Form("ZSTD")).read_bytes())
    place, length = chunks(raw)[0]
    raw[place + length - 20] ^= 0x55
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(raw)
    assert COUNT / 2 < len(read_recording(bad).stamps) < COUNT


@pytest.mark.parametrize("which", ["opcode", "length", "packed length"])
def test_reading_goes_on_after_a_record_that_makes_no_sense(tmp_path: Path, which: str) -> None:
    raw = bytearray(sample(tmp_path / "good.mcap", Form("ZSTD")).read_bytes())
    places = chunks(raw)
    place, _ = places[2]
    raw[place + {"opcode": 0, "length": 2, "packed length": 9 + 28 + 4 + 4}[which]] ^= 0x70
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(raw)
    found = read_recording(bad)
    lost = COUNT - len(found.stamps)
    assert 10 < lost < 2 * COUNT / len(places)
    assert any(f"at byte {place}: " in note for note in found.notes)


def test_a_message_that_is_not_there_is_missed(tmp_path: Path) -> None:
    """A chunk without its checksum, whose last message became a record of a kind that is skipped."""
    raw = bytearray(sample(tmp_path / "good.mcap", Form("NONE", checksums=False)).read_bytes())
    place, length = chunks(raw)[0]
    last = [start for opcode, start, _ in records(b"x" * 8 + raw[place + 9 + 40 : place + length]) if opcode == 5][-1]
    raw[place + 9 + 40 - 8 + last] = 0x81
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(raw)
    found = read_recording(bad)
    assert len(found.stamps) == COUNT - 1
    assert found.notes == ("damaged: 1 messages that the summary of the file counts are not there",)


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_lengths_that_ask_for_gigabytes(tmp_path: Path, compression: str) -> None:
    """Chunks that unpack to far more than they say, that claim to be huge, and records without end."""
    import lz4.frame
    import zstandard

    zeros = bytes(2**26)
    packed = {"zstd": zstandard.compress(zeros, 1), "lz4": lz4.frame.compress(zeros), "": zeros[:1000]}[compression]
    files = [struct.pack("<BQ", 5, 2**60)]
    for size in (999, 2**30 + 1, 2**50, 2**64 - 1):
        head = struct.pack("<QQQI", 0, 0, size, 0) + text(compression)
        files.append(record(6, head + struct.pack("<Q", len(packed)) + packed))
        files.append(record(6, head + struct.pack("<Q", 2**63) + packed))
    path = tmp_path / "bomb.mcap"
    start = time.perf_counter()
    tracemalloc.start()
    for content in files:
        path.write_bytes(b"\x89MCAP0\r\n" + record(1, text("") + text("")) + content)
        with pytest.raises(InputFileError, match="found no topic with joint states.*damaged"):
            read_recording(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert time.perf_counter() - start < 10
    # None of the chunks may be unpacked (2^26 bytes); a few pieces of the file are read.
    assert most < 16e6


def test_a_frame_that_asks_for_a_huge_window(tmp_path: Path) -> None:
    frame = bytes.fromhex("28b52ffd") + bytes([0x00, 0xF8]) + bytes(30)  # window descriptor: 2^41 bytes
    head = struct.pack("<QQQI", 0, 0, 2**20, 0) + text("zstd") + struct.pack("<Q", len(frame))
    path = tmp_path / "window.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + record(1, text("") + text("")) + record(6, head + frame))
    with pytest.raises(InputFileError, match="a chunk cannot be unpacked"):
        read_recording(path)


def test_damaged_summary_does_no_harm(tmp_path: Path) -> None:
    good = sample(tmp_path / "good.mcap", Form("ZSTD"))
    raw = bytearray(good.read_bytes())
    start = struct.unpack_from("<Q", raw, len(raw) - 8 - 20)[0]
    raw[start + 12] ^= 1
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(raw)
    found = read_recording(bad)
    assert len(found.stamps) == COUNT
    assert found.notes == (f"damaged: at byte {len(raw) - 37}: the summary is damaged",)


def test_messages_of_no_known_topic_are_counted(tmp_path: Path) -> None:
    good = sample(tmp_path / "good.mcap", Form("NONE", chunked=False))
    raw = good.read_bytes()
    stray = record(5, struct.pack("<HIQQ", 77, 0, 0, 0) + b"x")
    place = records(raw)[5][1]
    data_end = next(start for opcode, start, _ in records(raw) if opcode == 15)
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(raw[:place] + stray + raw[place:data_end])
    found = read_recording(bad)
    assert len(found.stamps) == COUNT
    assert "1 messages belong to no topic that the file describes" in found.notes


def test_memory_is_that_of_the_values(tmp_path: Path) -> None:
    """A file of many chunks: what is kept are the wanted columns, 8 bytes a number."""
    path = tmp_path / "large.mcap"
    chunk, count = large_chunk(), 60
    with path.open("wb") as stream:
        stream.write(b"\x89MCAP0\r\n" + record(1, text("ros2") + text("")))
        for _ in range(count):
            stream.write(chunk)
    tracemalloc.start()
    assert len(read_recording(path, ("a",), LogOptions(time="log")).stamps) == 2
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # 60 chunks of 1 MB with 1000 messages: about 100 bytes a message for numbers, times and copies of them, and a few
    # copies of one chunk.
    assert most < 60_000 * 200 + 15e6 < path.stat().st_size / 2


def large_chunk() -> bytes:
    """1000 messages of 1 kB without compression, all with one log time but the first."""
    definition = b"std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    schema = (
        struct.pack("<H", 1) + text(JOINT_STATE) + text("ros2msg") + struct.pack("<I", len(definition)) + definition
    )
    channel = struct.pack("<HH", 1, 1) + text("/joint_states") + text("cdr") + struct.pack("<I", 0)
    import tests.mcap_samples as samples

    names = ["a", *(f"other_{k}" for k in range(30))]
    data = samples.serialize(JOINT_STATE, joint_state(1.0, names, [0.0] * 31, [0.0] * 31, [0.0] * 31))
    messages = b"".join(record(5, struct.pack("<HIQQ", 1, 0, min(k, 1), 0) + data) for k in range(1000))
    inside = record(3, schema) + record(4, channel) + messages
    head = struct.pack("<QQQI", 0, 1, len(inside), zlib.crc32(inside)) + text("") + struct.pack("<Q", len(inside))
    return record(6, head + inside)
