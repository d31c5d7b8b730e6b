"""The topics of a file that carry joint states, and what is on them."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from modrob_cli.arrays import Indices
from modrob_cli.io.joint_batch import Batch, Faults
from modrob_cli.io.joint_cdr import CdrDecoder
from modrob_cli.io.joint_places import READERS
from modrob_cli.io.joint_single import json_decoder, protobuf_decoder
from modrob_cli.io.mcap_chunks import Block, Schema
from modrob_cli.io.mcap_records import McapFile

_CDR_RANKS = {name: rank for rank, name in enumerate(READERS)}
_FOXGLOVE_RANK = _CDR_RANKS["foxglove_msgs/JointStates"]
ACCEPTED = (
    "sensor_msgs/msg/JointState, control_msgs/msg/DynamicJointState, control_msgs/msg/JointTrajectoryControllerState, "
    "foxglove.JointStates, JSON joint states"
)


class Decoder(Protocol):
    """Turns messages of one channel into batches."""

    faults: Faults

    def decode(self, block: Block, chosen: Indices, order: Indices) -> Iterator[Batch]:
        """Joint states of the chosen messages of a block."""
        ...


@dataclass
class JointChannel:
    """A channel that carries joint states.

    Attributes
    ----------
    rank : 0 for ``sensor_msgs/msg/JointState``; a topic of a higher rank is used only where there is none of a lower
    kind : type and encoding, for people
    problem : why it cannot be decoded; "" if it can
    """

    number: int
    topic: str
    kind: str
    rank: int
    decoder: Decoder | None
    problem: str = ""


class JointTopics:
    """Decodes what an MCAP file says about joints.

    Attributes
    ----------
    file : the file, with what is damaged in it
    channels : channels with joint states by number, as far as the file was read
    """

    def __init__(self, path: Path, topic: str | None = None) -> None:
        self.file = McapFile(path)
        self.topic = topic
        self.channels: dict[int, JointChannel] = {}
        self.unknown = 0
        self._seen: dict[int, JointChannel | None] = {}
        self._count = 0

    def batches(self, best_only: bool) -> Iterator[tuple[JointChannel, Batch]]:
        """Joint states in pieces, roughly in the order of the file.

        Parameters
        ----------
        best_only : pass over channels of a higher rank than the lowest that had a message so far

        Raises
        ------
        InputFileError
            If the file cannot be read or is no MCAP file.
        """
        best = len(READERS)
        for block in self.file.blocks():
            order = self._count + np.arange(len(block.channels), dtype=np.int64)
            self._count += len(order)
            present = np.unique(block.channels).tolist()
            found = [channel for number in present if (channel := self._channel(number, block)) is not None]
            for channel in sorted(found, key=lambda item: item.rank):
                if channel.decoder is None or (best_only and channel.rank > best):
                    continue
                best = min(best, channel.rank)
                chosen = np.flatnonzero(block.channels == channel.number)
                for batch in channel.decoder.decode(block, chosen, order[chosen]):
                    yield channel, batch
            self.unknown += sum(
                int(np.count_nonzero(block.channels == k)) for k in present if k not in self.file.channels
            )

    @property
    def seen(self) -> int:
        """Messages of all kinds in the blocks that were begun; it changes when the block of a batch does."""
        return self._count

    def _channel(self, number: int, block: Block) -> JointChannel | None:
        """Find the channel of this number, if it carries joint states on a topic that is wanted."""
        if number not in self._seen and number in self.file.channels:
            first = int(np.argmax(block.channels == number))
            start = int(block.starts[first])
            channel = _identify(self.file, number, block.data[start : start + int(block.lengths[first])])
            self._seen[number] = channel
            if channel is not None:
                self.channels[number] = channel
        found = self._seen.get(number)
        return None if found is None or self.topic not in (None, found.topic) else found


def _identify(file: McapFile, number: int, message: bytes) -> JointChannel | None:
    """What a channel carries, by its encodings and type; JSON by a message too, as its types have any name."""
    channel = file.channels[number]
    schema = file.schemas.get(channel.schema, Schema("", "", b""))
    parts = schema.name.split("/")
    short = f"{parts[0]}/{parts[-1]}"
    kind = f"{schema.name or 'no type'}, {channel.encoding}"
    rank, problem = 0, ""
    decoder: Decoder | None = None
    try:
        if channel.encoding == "cdr" and short in READERS:
            rank, decoder = _CDR_RANKS[short], CdrDecoder(number, schema)
        elif channel.encoding == "protobuf" and schema.name == "foxglove.JointStates":
            rank, decoder = _FOXGLOVE_RANK, protobuf_decoder(number, schema)
        elif channel.encoding == "json" and _is_joint_json(message):
            rank = _FOXGLOVE_RANK if schema.name.endswith("JointStates") else 0
            decoder = json_decoder(number)
        else:
            return None
    except ValueError as error:
        problem = str(error)
    return JointChannel(number, channel.topic, kind, rank, decoder, problem)


def _is_joint_json(message: bytes) -> bool:
    from modrob_cli.io.joint_json import decode_json

    try:
        decode_json(message)
    except ValueError:
        return False
    return True
