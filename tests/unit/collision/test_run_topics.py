"""What logs tell beside joint states: written with our writer, whose messages other tests read with other readers."""

from pathlib import Path

import numpy as np

from modrob_cli.io.log_options import LogOptions
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.ros_messages import controller_state, joint_state, joint_truth, wrench_stamped
from modrob_cli.io.run_topics import read_run

NAMES = ("a", "b")
STAMPS = np.arange(5, dtype=np.int64) * 10_000_000 + 10**18


def joints() -> Series:
    return Series("/joint_states", joint_state(NAMES), STAMPS, np.arange(30.0).reshape(5, 6))


def test_desired_accelerations_and_contacts(tmp_path: Path) -> None:
    """The reference is read, not the feedback; names of the log are renamed; a contact lasts while its wrench does."""
    layout = controller_state(
        NAMES, {"reference": ("positions", "velocities", "accelerations"), "feedback": ("positions",)}
    )
    desired = np.arange(40.0).reshape(5, 8)
    wrench = np.zeros((5, 6))
    wrench[1:3, 2] = -4.0
    series = [
        joints(),
        Series("/controller_state", layout, STAMPS, desired),
        Series("/contacts/push", wrench_stamped("base"), STAMPS, wrench),
        Series("/force_sensor", wrench_stamped("base"), STAMPS, np.ones((5, 6))),
    ]
    write_mcap(tmp_path / "log.mcap", series)
    options = LogOptions(joint_map={"a": "left"})
    recording, topics = read_run(tmp_path / "log.mcap", ("left", "b"), options)
    assert recording.topic == "/joint_states"
    assert np.array_equal(recording.q, np.arange(30.0).reshape(5, 6)[:, :2])
    (found,) = topics.desired
    assert found.names == ("left", "b")
    assert np.array_equal(found.stamps, STAMPS)
    assert np.array_equal(found.values[2], desired[:, 4:6])
    (contact,) = topics.contacts
    assert contact.name == "push"
    assert contact.windows == ((int(STAMPS[1]), int(STAMPS[3])),)
    assert topics.labelled


def test_the_truth_tells_where_no_contact_has_a_topic(tmp_path: Path) -> None:
    truth = np.zeros((5, 12))
    write_mcap(tmp_path / "free.mcap", [joints(), Series("/truth", joint_truth(NAMES), STAMPS, truth)])
    _, topics = read_run(tmp_path / "free.mcap", NAMES, LogOptions())
    assert (topics.contacts, topics.labelled) == ((), True)
    truth = truth.copy()
    truth[3, 11] = 2.0  # external torque of the second joint
    write_mcap(tmp_path / "pushed.mcap", [joints(), Series("/truth", joint_truth(NAMES), STAMPS, truth)])
    _, topics = read_run(tmp_path / "pushed.mcap", NAMES, LogOptions())
    assert topics.contacts[0].windows == ((int(STAMPS[3]), int(STAMPS[4])),)


def test_a_log_without_labels_says_so(tmp_path: Path) -> None:
    write_mcap(tmp_path / "log.mcap", [joints()])
    _, topics = read_run(tmp_path / "log.mcap", NAMES, LogOptions())
    assert (topics.desired, topics.contacts, topics.labelled) == ((), (), False)
