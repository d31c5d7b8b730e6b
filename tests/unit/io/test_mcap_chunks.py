"""Messages of a chunk taken many at a time against one at a time."""

import numpy as np
import pytest

from modrob_cli.io.mcap_chunks import HEAD, MESSAGE_HEAD, Block, BlockBuilder, Opcode
from modrob_cli.io.mcap_damage import DamageError


def records(rng: np.random.Generator, count: int, bad: int | None = None) -> bytes:
    """Message records of a few lengths, most of them alike; one with an impossible time."""
    out = b""
    for k in range(count):
        size = 40 if rng.random() < 0.97 else int(rng.integers(0, 3)) * 10
        time = 2**63 + 5 if k == bad else 1000 * k
        head = MESSAGE_HEAD.pack(int(rng.integers(1, 4)), k, time, time)
        out += HEAD.pack(Opcode.MESSAGE, MESSAGE_HEAD.size + size) + head + rng.bytes(size)
    return out


def taken(data: bytes, alike: bool) -> tuple[Block, str]:
    """All messages, and the error that ends them if there is one."""
    builder, place = BlockBuilder(), 0
    try:
        while place < len(data):
            _, length = HEAD.unpack_from(data, place)
            place += HEAD.size
            if alike:
                place = builder.add_alike(data, place, length)
            else:
                builder.add(data, place, length)
                place += length
    except DamageError as error:
        return builder.build(data), str(error)
    return builder.build(data), ""


@pytest.mark.parametrize("seed", range(12))
def test_many_at_a_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    data = records(rng, int(rng.integers(1, 600)), int(rng.integers(0, 300)) if seed % 2 else None)
    (found, error), (expected, expected_error) = taken(data, alike=True), taken(data, alike=False)
    assert error == expected_error
    for key in ("channels", "starts", "lengths", "log_times"):
        np.testing.assert_array_equal(getattr(found, key), getattr(expected, key), err_msg=key)
