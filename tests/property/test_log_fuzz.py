"""Damaged logs of every kind, without checksums: a result or an error that names the file, nothing else."""

from pathlib import Path

import numpy as np
import pytest

from modrob_cli.errors import InputFileError
from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_reader import read_joint_log, read_recording
from modrob_cli.workflows.log_info import log_info
from tests.mcap_samples import Form, write_topics
from tests.unit.io.test_log_kinds import KINDS

FILES = 60


def damaged(raw: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes flipped, set, replaced or taken out."""
    data = bytearray(raw)
    for _ in range(rng.integers(1, 8)):
        place, way = int(rng.integers(len(data))), rng.integers(4)
        if way == 0:
            data[place] ^= int(rng.integers(1, 256))
        elif way == 1:
            data[place] = 255
        elif way == 2:
            data[place : place + 8] = rng.bytes(8)
        else:
            del data[place : place + int(rng.integers(1, 20))]
    return bytes(data)


@pytest.mark.parametrize("chunked", [True, False])
@pytest.mark.parametrize("kind", list(KINDS))
def test_damaged_logs_of_every_kind(tmp_path: Path, kind: str, chunked: bool) -> None:
    raw = write_topics(
        tmp_path / "good.mcap", [KINDS[kind]()], Form("NONE", 1000, chunked, checksums=False)
    ).read_bytes()
    rng = np.random.default_rng(5)
    path = tmp_path / "bad.mcap"
    calls = (
        lambda: read_recording(path),
        lambda: read_joint_log(path, ("a", "b"), options=LogOptions(time="log")),
        lambda: log_info([path], LogOptions()),
    )
    read, messages = 0, [str(path)]
    for _ in range(FILES):
        path.write_bytes(damaged(raw, rng))
        for call in calls:
            try:
                call()
                read += 1
            except InputFileError as error:
                messages.append(str(error))
    assert read > FILES  # of three times as many
    assert all(str(path) in message for message in messages)
