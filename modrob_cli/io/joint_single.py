"""Joint states from messages that are decoded one by one: JSON and protobuf."""

from collections import defaultdict
from collections.abc import Callable, Iterator

import numpy as np

from modrob_cli.arrays import Indices
from modrob_cli.io.foxglove_protobuf import decode_joint_states, read_numbers
from modrob_cli.io.joint_batch import NO_STAMP, QUANTITIES, Batch, Faults, Source, check_names
from modrob_cli.io.joint_json import Decoded, decode_json
from modrob_cli.io.mcap_chunks import Block, Schema

_LARGEST_STAMP = 2**61


class SingleDecoder:
    """Decodes the messages of one channel with a function for one message."""

    def __init__(self, channel: int, decode_one: Callable[[bytes], Decoded]) -> None:
        self.channel = channel
        self.faults = Faults()
        self._decode_one = decode_one

    def decode(self, block: Block, chosen: Indices, order: Indices) -> Iterator[Batch]:
        """Joint states of the chosen messages of a block, which have the numbers ``order`` in the file."""
        rows: dict[Source, list[tuple[int, int, int, list[list[float]]]]] = defaultdict(list)
        starts, lengths, times = (part[chosen].tolist() for part in (block.starts, block.lengths, block.log_times))
        for number, start, length, time in zip(order.tolist(), starts, lengths, times, strict=True):
            try:
                stamp, frame, names, lists = self._decode_one(block.data[start : start + length])
                check_names(names)
                if abs(stamp) > _LARGEST_STAMP and stamp != NO_STAMP:
                    raise ValueError("its stamp is out of range")
            except ValueError as error:
                self.faults.add(" ".join(str(error).split())[:100])
                continue
            recorded = tuple(key for key, values in zip(QUANTITIES, lists, strict=True) if values)
            full = [values or [np.nan] * len(names) for values in lists]
            rows[Source(self.channel, names, frame, recorded)].append((number, stamp, time, full))
        for source, found in rows.items():
            numbers, stamps, log_times, values = zip(*found, strict=True)
            columns = np.array(values, dtype=float).reshape(len(found), 3, len(source.names)).transpose(1, 0, 2)
            whole = [np.array(part, dtype=np.int64) for part in (numbers, stamps, log_times)]
            yield Batch(source, whole[0], whole[1], whole[2], columns)


def json_decoder(channel: int) -> SingleDecoder:
    """For messages in JSON."""
    return SingleDecoder(channel, decode_json)


def protobuf_decoder(channel: int, schema: Schema) -> SingleDecoder:
    """For ``foxglove.JointStates``.

    Raises
    ------
    ValueError
        If the descriptor in the file cannot be used.
    """
    numbers = read_numbers(schema.data)

    def decode_one(data: bytes) -> Decoded:
        stamp, names, lists = decode_joint_states(data, numbers)
        return stamp, "", names, lists

    return SingleDecoder(channel, decode_one)
