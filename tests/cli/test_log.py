"""``modrob log info`` and ``modrob log convert`` as a user runs them."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from modrob_cli.cli.app import app
from tests.mcap_samples import CONTROLLER_STATE, JOINT_STATE, Topic, cdr_topic, header, joint_state, point, write_topics
from tests.shared_data import shared

NAMES = ("b", "a")


def modrob(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["log", *(str(argument) for argument in arguments)])


def states(count: int = 100) -> list[dict[str, Any]]:
    rng = np.random.default_rng(1)
    return [
        joint_state(
            20.0 + 0.01 * k + 0.5 * (k >= 60), NAMES, np.sin(0.1 * k + np.arange(2)), rng.normal(size=2), [k, -k]
        )
        for k in range(count)
    ]


def record(path: Path, rows: list[dict[str, Any]] | None = None) -> Path:
    rows = states() if rows is None else rows
    other = [{"header": header(1.0 + k), "joint_names": ["a"], "reference": point([k]), "feedback": point([k]),
              "error": point(), "output": point(), "speed_scaling_factor": 1.0} for k in range(5)]  # fmt: skip
    image = Topic("/camera", "sensor_msgs/msg/Image", [(k, b"\0\1\0\0") for k in range(7)], schema=b"uint8 x\n")
    topics = [cdr_topic("/joint_states", JOINT_STATE, rows), cdr_topic("/controller", CONTROLLER_STATE, other), image]
    return write_topics(path, topics)


def test_info_describes_a_log(tmp_path: Path) -> None:
    done = modrob("info", record(tmp_path / "run.mcap"), "--json")
    assert done.exit_code == 0, done.output
    (log,) = json.loads(done.stdout)["logs"]
    assert [(one["topic"], one["messages"]) for one in log["topics"]] == [
        ("/camera", 7), ("/controller", 5), ("/joint_states", 100),
    ]  # fmt: skip
    controller, joints = log["joint_topics"]
    assert (controller["used"], joints["used"]) == (False, True)
    assert [joint["name"] for joint in joints["joints"]] == ["b", "a"]
    assert joints["joints"][0]["effort"] == {"min": 0, "max": 99, "missing": 0}
    assert joints["joints"][1]["effort"] == {"min": -99, "max": 0, "missing": 0}
    assert controller["joints"][0]["effort"] == {"min": None, "max": None, "missing": 5}
    times = joints["header_time"]
    assert times["rate"] == pytest.approx(100.0)
    assert times["duration"] == pytest.approx(0.99 + 0.5)
    assert times["gaps"] == [[pytest.approx(0.59), pytest.approx(0.51)]]
    assert (times["gap_count"], times["repeated"], times["backward"], times["missing"]) == (1, 0, 0, 0)
    assert log["read"]["topic"] == "/joint_states"
    assert (log["read"]["samples"], log["problem"], log["damage"]["cut"]) == (100, None, False)
    for words in (
        "/camera",
        "100 Hz",
        "1 gaps (0.51 s after 0.59 s)",
        "-99 .. 0",
        "is read from /joint_states, header",
    ):
        assert words in done.stderr


def test_info_says_why_a_log_cannot_be_read_as_it_is(tmp_path: Path) -> None:
    rows = states(10)
    twice = [cdr_topic("/left", JOINT_STATE, rows), cdr_topic("/right", JOINT_STATE, rows)]
    path = write_topics(tmp_path / "run.mcap", twice)
    done = modrob("info", path, "--json")
    assert done.exit_code == 0
    (log,) = json.loads(done.stdout)["logs"]
    assert log["read"] is None
    assert "choose one with --topic" in log["problem"]
    assert not any(one["used"] for one in log["joint_topics"])
    chosen = json.loads(modrob("info", path, "--topic", "/right", "--json").stdout)["logs"][0]
    assert [one["used"] for one in chosen["joint_topics"]] == [False, True]
    assert chosen["read"]["samples"] == 10


def test_info_counts_disorder(tmp_path: Path) -> None:
    rows = states(20)
    mixed = [*rows[:5], rows[6], rows[5], rows[5], *rows[7:]]
    (log,) = json.loads(modrob("info", record(tmp_path / "run.mcap", mixed), "--json").stdout)["logs"]
    times = log["joint_topics"][1]["header_time"]
    assert (times["repeated"], times["backward"]) == (1, 1)
    assert times["worst_back"] == pytest.approx(0.01)
    assert log["read"]["repeated"] == 1


def test_info_of_damaged_files(tmp_path: Path) -> None:
    raw = record(tmp_path / "run.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(raw[: len(raw) // 2])
    done = modrob("info", cut, "--json")
    assert done.exit_code == 0
    damage = json.loads(done.stdout)["logs"][0]["damage"]
    assert damage["cut"]
    assert "damaged: the file ends in the middle" in done.stderr
    assert modrob("info", cut, "--strict").exit_code == 3
    none, text = tmp_path / "none.mcap", tmp_path / "text.mcap"
    text.write_text("hello")
    done = modrob("info", cut, none, text)
    assert done.exit_code == 3
    assert "none.mcap: file not found" in done.stderr
    assert "text.mcap: found something else, expected an MCAP file" in done.stderr


def test_there_and_back_between_mcap_and_csv_is_exact(tmp_path: Path) -> None:
    rows = states()
    for k, row in enumerate(rows):
        row["header"]["stamp"] = {"sec": 1_700_000_000 + k, "nanosec": 123_456_789}
        row["velocity"][1] = np.nan if k % 3 else 0.1
    first, second, third = (tmp_path / name for name in ("a.csv", "b.mcap", "c.csv"))
    assert modrob("convert", record(tmp_path / "run.mcap", rows), first).exit_code == 0
    assert modrob("convert", first, second).exit_code == 0
    done = modrob("convert", second, third, "--json")
    assert done.exit_code == 0
    assert first.read_bytes() == third.read_bytes()
    result = json.loads(done.stdout)
    assert (result["samples"], result["joints"], result["quantities"]) == (100, ["b", "a"], ["q", "dq", "effort"])
    lines = first.read_text().splitlines()
    assert lines[0] == "t,q.b,q.a,dq.b,dq.a,effort.b,effort.a"
    assert lines[2].startswith(f"1700000001.123456789,{rows[1]['position'][0]!r},")
    assert lines[2].endswith(f",{rows[1]['velocity'][0]!r},,1.0,-1.0")


def test_written_mcap_is_what_other_readers_read(tmp_path: Path) -> None:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory
    from rosbags.highlevel import AnyReader

    rows = states()
    out = tmp_path / "out.mcap"
    done = modrob("convert", record(tmp_path / "run.mcap", rows), out, "--joints", "a", "--map", "a=elbow", "--json")
    assert done.exit_code == 3  # the joint is called elbow now
    assert "not in the log: a" in done.stderr
    done = modrob("convert", tmp_path / "run.mcap", out, "--joints", "elbow", "--map", "a=elbow", "--from-zero")
    assert done.exit_code == 0, done.output
    with out.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        found = [
            (item.channel.topic, item.schema and item.schema.name, item.decoded_message)
            for item in reader.iter_decoded_messages()
        ]
    assert {one[:2] for one in found} == {("/joint_states", JOINT_STATE)}
    messages = [one[2] for one in found]
    with AnyReader([out]) as bag:
        again: list[Any] = [bag.deserialize(data, one.msgtype) for one, _, data in bag.messages()]
    for decoded in (messages, again):
        assert [list(message.name) for message in decoded] == [["elbow"]] * 100
        for key in ("position", "velocity", "effort"):
            expected = [row[key][1] for row in rows]
            np.testing.assert_array_equal([getattr(message, key)[0] for message in decoded], expected)
    assert messages[0].header.stamp.sec == 0


def test_convert_repairs_a_damaged_file(tmp_path: Path) -> None:
    raw = record(tmp_path / "run.mcap").read_bytes()
    cut, out = tmp_path / "cut.mcap", tmp_path / "whole.mcap"
    cut.write_bytes(raw[: len(raw) * 3 // 4])
    assert modrob("convert", cut, out, "--strict").exit_code == 3
    assert not out.exists()
    done = modrob("convert", cut, out)
    assert done.exit_code == 0
    assert "note: damaged: the file ends in the middle" in done.stderr
    (log,) = json.loads(modrob("info", out, "--strict", "--json").stdout)["logs"]
    assert 40 < log["read"]["samples"] < 100


def test_convert_keeps_existing_files_and_refuses_other_endings(tmp_path: Path) -> None:
    path, out = record(tmp_path / "run.mcap"), tmp_path / "new" / "out.csv"
    assert modrob("convert", path, out).exit_code == 0
    assert modrob("convert", path, out).exit_code == 6
    assert modrob("convert", path, out, "--overwrite").exit_code == 0
    done = modrob("convert", path, tmp_path / "out.bag")
    assert done.exit_code == 2
    assert "expected .csv or .mcap" in done.stderr


def test_times_that_messages_cannot_hold(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t,q.a,effort.a\n-1,1,2\n3,4,5\n")
    done = modrob("convert", path, tmp_path / "out.mcap")
    assert done.exit_code == 3
    assert "found times from -1 s to 3 s" in done.stderr
    assert modrob("convert", path, tmp_path / "out.mcap", "--from-zero").exit_code == 0
    info = json.loads(modrob("info", path, "--json").stdout)["logs"][0]
    assert (info["kind"], info["read"]["samples"], info["time"]["start"]) == ("csv", 2, -1.0)


def test_options_out_of_range(tmp_path: Path) -> None:
    path = record(tmp_path / "run.mcap")
    assert modrob("info", path, "--time", "arrival").exit_code == 2
    assert modrob("info", path, "--map", "a").exit_code == 2
    assert modrob("convert", path, tmp_path / "out.csv", "--publisher", "9").exit_code == 2
    assert modrob("info").exit_code == 2


def test_info_of_a_folder_goes_on_after_a_bad_log(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    for name in ("run_10", "run_2"):
        record(tmp_path / "runs" / f"{name}.mcap")
    bad = tmp_path / "runs" / "bad.mcap"
    bad.write_text("nothing")
    done = modrob("info", tmp_path / "runs", "--json")
    assert done.exit_code == 3
    result = json.loads(done.stdout)
    assert [Path(log["log"]).stem for log in result["logs"]] == ["run_2", "run_10"]
    reason = f"{bad}: found something else, expected an MCAP file"
    assert result["skipped"] == [{"log": str(bad), "reason": reason, "code": 3}]
    assert f"error: {reason}" in done.stderr


def test_info_of_a_url_names_the_url(tmp_path: Path) -> None:
    fsspec = pytest.importorskip("fsspec", reason="fsspec is not installed (extra modrob[dask])")
    fsspec.filesystem("memory").pipe_file("/info/run.mcap", record(tmp_path / "run.mcap").read_bytes())
    done = modrob("info", "memory://info/run.mcap", "--json")
    assert done.exit_code == 0, done.output
    (log,) = json.loads(done.stdout)["logs"]
    assert log["log"] == "memory://info/run.mcap"
    assert log["read"]["samples"] == 100


def test_help_shows_examples() -> None:
    for command in ("info", "convert"):
        assert f"Example: modrob log {command}" in " ".join(modrob(command, "--help").stdout.split())


@pytest.mark.parametrize(
    ("name", "samples", "rate"),
    [("ur10/ur10_exciting_trajectory.mcap", 3441, 125.0), ("staubli_tx40/ident.mcap", 45_000, 5000.0)],
)
def test_real_recordings(tmp_path: Path, name: str, samples: int, rate: float) -> None:
    path = shared(name)
    (log,) = json.loads(modrob("info", path, "--strict", "--json").stdout)["logs"]
    assert (log["read"]["samples"], log["read"]["notes"]) == (samples, [])
    assert log["read"]["rate"] == pytest.approx(rate, rel=1e-6)
    first, second, third = (tmp_path / name for name in ("a.csv", "b.mcap", "c.csv"))
    for source, target in ((path, first), (first, second), (second, third)):
        assert modrob("convert", source, target).exit_code == 0
    assert first.read_bytes() == third.read_bytes()


def test_many_real_recordings() -> None:
    folder = shared("schunk_lwa4p/runs")
    done = modrob("info", *sorted(folder.glob("*.mcap")), "--json")
    assert done.exit_code == 0
    logs = json.loads(done.stdout)["logs"]
    assert len(logs) == 100
    assert {tuple(log["read"]["joints"]) for log in logs} == {tuple(f"joint_{k}" for k in range(1, 7))}
    assert {round(log["read"]["rate"]) for log in logs} == {250}


def test_a_frame_of_two_gigabytes_is_not_believed(tmp_path: Path) -> None:
    path = tmp_path / "bad.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + struct.pack("<BQ", 6, 2**31) + bytes(100))
    done = modrob("info", path)
    assert done.exit_code == 3
    assert "no message can be read: the file ends in the middle" in done.stderr
    assert "Traceback" not in done.output
