"""Speed of writing MCAP: ``python -m benchmarks.mcap_write [--seconds 20]``, beside the mcap package's own writer.

Joint states and controller states of six joints at 1 kHz each, with noise that does not compress. The messages of the
other writer are encoded by the mcap-ros2-support package (from Python objects, as a program would have them) in the
first case, and by this package in the second, so that the second shows the writing of the file alone.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import POINT_LISTS, controller_state, joint_state

PARTS = ("reference", "feedback", "error", "output")
NAMES = tuple(f"joint{k}" for k in range(1, 7))


def series(seconds: float) -> list[Series]:
    """Two topics of random values."""
    rng = np.random.default_rng(0)
    stamps = np.arange(int(seconds * 1000), dtype=np.int64) * 1_000_000
    layouts = {
        "/joint_states": joint_state(NAMES),
        "/state": controller_state(NAMES, dict.fromkeys(PARTS, POINT_LISTS)),
    }
    return [Series(topic, kind, stamps, rng.normal(size=(len(stamps), kind.width))) for topic, kind in layouts.items()]


def write_decoded(path: Path, rows: list[Series]) -> None:
    """Encode objects and write with the mcap-ros2-support package; joint states only."""
    from mcap_ros2.writer import Writer

    one = rows[0]
    with path.open("wb") as stream:
        writer = Writer(stream)
        schema = writer.register_msgdef(one.layout.type_name, one.layout.definition)
        for stamp, values in zip(one.stamps.tolist(), one.values.tolist(), strict=True):
            header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": ""}
            lists = {key: values[6 * k : 6 * k + 6] for k, key in enumerate(("position", "velocity", "effort"))}
            message: dict[str, Any] = {"header": header, "name": list(NAMES), **lists}
            writer.write_message(one.topic, schema, message, log_time=stamp, publish_time=stamp)
        writer.finish()  # type: ignore[no-untyped-call]


def write_encoded(path: Path, rows: list[Series]) -> None:
    """Write bytes that are there already with the mcap package."""
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        for one in rows:
            schema = writer.register_schema(one.layout.type_name, "ros2msg", one.layout.definition.encode())
            channel = writer.register_channel(one.topic, "cdr", schema)
            for stamp, data in zip(one.stamps.tolist(), one.layout.encode(one.stamps, one.values), strict=True):
                writer.add_message(channel, stamp, data, stamp)
        writer.finish()  # type: ignore[no-untyped-call]


def main() -> None:
    """Print messages per second of processor time, the best of three runs."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=20.0)
    rows = series(parser.parse_args().seconds)
    cases: dict[str, tuple[Callable[[Path, list[Series]], None], list[Series]]] = {
        "write_mcap": (write_mcap, rows),
        "mcap, bytes that are encoded already": (write_encoded, rows),
        "write_mcap, joint states only": (write_mcap, rows[:1]),
        "mcap-ros2-support, joint states only": (write_decoded, rows[:1]),
    }
    with tempfile.TemporaryDirectory() as folder:
        for name, (write, part) in cases.items():
            times = []
            for _ in range(3):
                start = time.process_time()
                write(Path(folder) / "x.mcap", part)
                times.append(time.process_time() - start)
            print(f"{name:40s} {sum(len(one.stamps) for one in part) / min(times):12.0f} messages/s")


if __name__ == "__main__":
    main()
