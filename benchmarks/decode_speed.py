"""Speed of reading joint states from MCAP: ``python -m benchmarks.decode_speed [--messages 60000]``.

The same file of ROS 2 joint states is read by this package (to arrays that are in order and checked), by rosbags (to
message objects whose arrays are then stacked), and by mcap-ros2-support. Machines differ and are shared: compare the
ratios to rosbags. Medians of five runs, in CPU time; the runs of all readers are interleaved.
"""

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.bounds_speed import medians
from modrob_cli.arrays import Array
from modrob_cli.io.mcap_reader import read_joint_log
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import joint_state

TOPIC = "/joint_states"


def write_log(path: Path, messages: int, joints: int) -> None:
    """A motion of sines, with noise, at 1 kHz."""
    names = tuple(f"joint_{k + 1}" for k in range(joints))
    t = np.arange(messages) / 1000.0
    angle = np.sin(t[:, None] * np.linspace(0.5, 2.0, joints))
    noise = np.random.default_rng(1).normal(0.0, 1e-4, (3, messages, joints))
    values = np.concatenate(list(noise + np.stack([angle, np.gradient(angle, 1e-3, axis=0), 20.0 * angle])), axis=1)
    stamps = 1_700_000_000_000_000_000 + np.arange(messages, dtype=np.int64) * 1_000_000
    write_mcap(path, [Series(TOPIC, joint_state(names), stamps, values)])


def by_modrob(path: Path) -> Array:
    """Efforts, as every command of this package reads them."""
    return read_joint_log(path).effort


def by_rosbags(path: Path) -> Array:
    """Efforts by rosbags."""
    from rosbags.highlevel import AnyReader

    rows = []
    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages():
            message: Any = reader.deserialize(data, connection.msgtype)
            rows.append((message.position, message.velocity, message.effort))
    return np.array(rows)[:, 2]


def by_mcap_ros2(path: Path) -> Array:
    """Efforts by mcap-ros2-support."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    rows = []
    with path.open("rb") as stream:
        for item in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            message = item.decoded_message
            rows.append((message.position, message.velocity, message.effort))
    return np.array(rows)[:, 2]


def main() -> None:
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=60_000)
    parser.add_argument("--joints", type=int, default=7)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "run.mcap"
        write_log(path, arguments.messages, arguments.joints)
        readers: dict[str, Callable[[Path], Array]] = {
            "rosbags (reference)": by_rosbags,
            "modrob": by_modrob,
            "mcap-ros2-support": by_mcap_ros2,
        }
        expected = by_rosbags(path)
        for reader in readers.values():
            np.testing.assert_array_equal(reader(path), expected)
        found = medians({title: lambda reader=reader: reader(path) for title, reader in readers.items()})  # type: ignore[misc]
    print(f"{f'{arguments.messages} messages, {arguments.joints} joints':32} {'us/message':>10} {'ratio':>6}")
    for title, seconds in found.items():
        print(f"{title:32} {1e6 * seconds / arguments.messages:10.2f} {seconds / found['rosbags (reference)']:6.2f}")


if __name__ == "__main__":
    main()
