"""``modrob collision`` as a user runs it: on simulated logs whose truth is known."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from typer.testing import Result

from modrob_cli.errors import UsageError
from modrob_cli.io.mcap_reader import read_recording
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.workflows.collision_options import parse_filter

Modrob = Callable[..., Result]

ROOT = Path(__file__).parents[2]
ARM = ROOT / "assemblies" / "lwa4p-table34-friction.yaml"
STATED = (
    "--effort",
    "current",
    "--ddq-tolerance",
    "3",
    "--dq-noise",
    "1e-4",
    "--effort-noise",
    "0.05",
    "--skip",
    "0.2",
)


def test_a_push_is_found_and_a_clean_run_is_not_accused(modrob: Modrob, hit_logs: Path, tmp_path: Path) -> None:
    both = (hit_logs / "clean.mcap", hit_logs / "pushed.mcap")
    options = (*STATED, "--filter", "butterworth2:20", "--train", hit_logs / "clean.mcap", "--json", "-o", tmp_path)
    result = modrob("collision", ARM, *both, *options)
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    clean, pushed = data["logs"]
    assert data["collision"] is True
    assert clean["events"] == []
    assert clean["contacts"] == []
    first = pushed["events"][0]
    assert {"start", "end", "joint", "side", "peak", "peak_effort", "effort_unit"} <= set(first)
    assert 0.9 < first["start"] < 1.3
    assert first["effort_unit"] == "A"
    # [D] 2.4: joint torque is torque constant times gear ratio times current.
    assert first["peak"] == pytest.approx(first["peak_effort"] * 0.0429 * 160)
    (contact,) = pushed["contacts"]
    assert (contact["start"], contact["end"]) == (pytest.approx(0.9), pytest.approx(1.3))
    assert contact["delays"]["bands"] == pytest.approx(first["start"] - contact["start"])
    by_name = {method["method"]: method for method in pushed["methods"]}
    assert list(by_name) == ["bands", "ianea", "constant", "observer"]
    assert (by_name["bands"]["false_alarms"], by_name["bands"]["detected"]) == (0, 1)
    for joint in pushed["sensitivity"]:
        assert 0.0 < joint["least"] <= joint["median"] <= joint["min_detectable"]
        assert joint["other_band_ratio"] > 0.95
    for path in data["files"].values():
        assert Path(path).is_file()
    assert "no event" in result.stderr


def test_fail_on_collision_is_for_ci(modrob: Modrob, hit_logs: Path, tmp_path: Path) -> None:
    options = (*STATED, "--fail-on-collision", "--no-compare", "--details", "0")
    assert modrob("collision", ARM, hit_logs / "clean.mcap", *options, "-o", tmp_path / "a").exit_code == 0
    result = modrob("collision", ARM, hit_logs / "pushed.mcap", *options, "-o", tmp_path / "b")
    assert result.exit_code == 4
    assert "collision: pushed: " in result.stderr
    assert (tmp_path / "b" / "pushed.collision.json").is_file()


def test_files_say_the_same(modrob: Modrob, hit_logs: Path, tmp_path: Path) -> None:
    """CSV and MCAP hold measurement and band in amperes; the table holds the band; the page is one file."""
    options = (*STATED, "--filter", "first-order:20", "--point", "q4:0,0,0.1", "--json", "-o", tmp_path)
    result = modrob("collision", ARM, hit_logs / "pushed.mcap", *options)
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    with (tmp_path / "pushed.collision.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    table = dict(zip(header, np.array(rows, dtype=float).T, strict=True))
    # Joint states without positions: read by the mcap package and its ROS 2 decoder.
    with (tmp_path / "pushed.collision.mcap").open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        upper = [message.effort for *_, message in reader.iter_decoded_messages(topics=["/collision/upper"])]
    assert np.allclose(np.array(upper)[:, 1], table["q2.upper"], rtol=1e-15)
    outside = table["q2.measured"] > table["q2.upper"]
    event = [one for one in data["logs"][0]["events"] if one["joint"] == "q2" and one["side"] == "upper"]
    assert outside.any() == bool(event)
    document = yaml.safe_load(
        (tmp_path / "lwa4p-table34-friction.collision.thresholds.yaml").read_text(encoding="utf-8")
    )
    request = document["request"]
    assert list(request) == [
        f"{end}_{kind}_thresholds_{phase}"
        for kind in ("torque", "force")
        for phase in ("acceleration", "nominal")
        for end in ("lower", "upper")
    ]
    worst = max(np.max(request[f"lower_torque_thresholds_{phase}"][1]) for phase in ("acceleration", "nominal"))
    half = 0.5 * (table["q2.upper"] - table["q2.lower"]).max() * 0.0429 * 160
    assert half <= worst <= 2.0 * half
    assert [len(values) for values in request.values()] == [6] * 8
    page = (tmp_path / "lwa4p-table34-friction.collision.html").read_text(encoding="utf-8")
    assert "Collision found" in page
    assert "Signature" in page or "signature" in page
    assert data["logs"][0]["contact_forces"][1]["point"] == "q4:0,0,0.1"


def test_planned_motions_give_thresholds(modrob: Modrob, hit_logs: Path, tmp_path: Path) -> None:
    result = modrob("collision", ARM, hit_logs / "motion.yaml", "--ddq-tolerance", "0.5", "--json", "-o", tmp_path)
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["collision"] is None
    (log,) = data["logs"]
    assert log["planned"]
    assert log["methods"] == []
    assert log["sensitivity"][0]["min_detectable"] > 0.0
    assert log["contact_forces"][0]["worst_direction"]["median"] > log["contact_forces"][0]["best_direction"]["median"]


def test_accelerations_from_the_measurement_and_from_a_planned_file(
    modrob: Modrob, hit_logs: Path, tmp_path: Path
) -> None:
    """Three ways to know the acceleration; none accuses the clean run, all find the push."""
    stated = ("--effort", "current", "--dq-noise", "1e-4", "--effort-noise", "0.05", "--skip", "0.2")
    ways = {
        "file": ("--desired", hit_logs / "motion.yaml", "--ddq-tolerance", "3"),
        "measured": ("--acceleration", "measured", "--jerk", "3000"),
        "smoothed": ("--acceleration", "smoothed", "--cutoff", "20", "--ddq-tolerance", "3"),
    }
    for name, way in ways.items():
        both = (hit_logs / "clean.mcap", hit_logs / "pushed.mcap")
        result = modrob(
            "collision", ARM, *both, *stated, *way, "--no-compare", "--details", "0", "--json", "-o", tmp_path / name
        )
        assert result.exit_code == 0, result.output
        clean, pushed = json.loads(result.stdout)["logs"]
        assert clean["events"] == [], name
        assert pushed["methods"][0]["detected"] == 1, name


def without_desired(source: Path, path: Path) -> Path:
    """The joint states of a log alone."""
    log = read_recording(source)
    assert log.dq is not None
    assert log.effort is not None
    write_mcap(
        path,
        [Series("/joint_states", joint_state(log.joint_names), log.stamps, np.hstack([log.q, log.dq, log.effort]))],
    )
    return path


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        ((), 2, "--effort is missing"),
        (("--effort", "volts"), 2, "expected torque, current, motor-torque"),
        (("--effort", "current"), 3, "--ddq-tolerance"),
        ((*STATED, "--filter", "butterworth"), 2, "expected none, first-order:HZ"),
        ((*STATED, "--filter", "butterworth9:10"), 2, "order 9, expected 1 .. 8"),
        ((*STATED, "--filter", "butterworth2:400"), 5, "half the sampling rate, 250 Hz"),
        ((*STATED, "--point", "hand:0,0,0"), 2, "found the link 'hand'"),
        ((*STATED, "--point", "q1:0,0"), 2, "expected LINK:x,y,z"),
        ((*STATED, "--jerk", "10"), 2, "--jerk is for --acceleration measured"),
        ((*STATED, "--acceleration", "measured"), 2, "follows from --dq-noise and --jerk"),
        (("--effort", "current", "--acceleration", "measured"), 2, "needs a bound of the jerk"),
        ((*STATED, "--desired", "nowhere.yaml"), 3, "nowhere.yaml"),
        ((*STATED, "--margin", "-1"), 2, "--margin: found -1"),
        ((*STATED, "--skip", "100"), 3, "leaves nothing of the log"),
        ((*STATED, "--dq-noise", "1,2"), 2, "found 2 numbers"),
    ],
    ids=lambda value: " ".join(map(str, value[-2:])) if isinstance(value, tuple) else None,
)
def test_what_does_not_fit_is_said(
    modrob: Modrob, hit_logs: Path, tmp_path: Path, options: tuple[str, ...], code: int, said: str
) -> None:
    result = modrob("collision", ARM, hit_logs / "clean.mcap", *options, "-o", tmp_path / "out")
    assert result.exit_code == code, result.output
    assert said in result.stderr
    assert not (tmp_path / "out").exists()


def test_faults_of_all_logs_at_once_and_nothing_is_overwritten(modrob: Modrob, hit_logs: Path, tmp_path: Path) -> None:
    bare = without_desired(hit_logs / "clean.mcap", tmp_path / "bare.mcap")
    (tmp_path / "bad.mcap").write_bytes(b"nonsense")
    result = modrob("collision", ARM, bare, tmp_path / "bad.mcap", *STATED, "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert "no topic of a controller" in result.stderr
    assert "bad.mcap" in result.stderr
    first = modrob("collision", ARM, hit_logs / "clean.mcap", *STATED, "--no-compare", "-o", tmp_path / "out")
    assert first.exit_code == 0, first.output
    assert modrob("collision", ARM, hit_logs / "clean.mcap", *STATED, "-o", tmp_path / "out").exit_code == 6


def test_filters_are_read() -> None:
    assert str(parse_filter("none")) == "none"
    assert str(parse_filter("first-order:10")) == "first-order:10"
    assert str(parse_filter("first-order:1e1x3")) == "first-order:10x3"
    assert str(parse_filter("butterworth4:2.5")) == "butterworth4:2.5"
    for text in (
        "",
        "butterworth2",
        "butterworth2:-1",
        "butterworth2:nan",
        "butterworth0:1",
        "butterworth2:5x2",
        "x:1",
    ):
        with pytest.raises(UsageError):
            parse_filter(text)
