"""A user's own controller: what it gets, what may come back, and where its faults are said to be."""

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.errors import InputFileError, UsageError
from modrob_cli.io.python_controller import controller_file
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Control
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.interface import ControlTask, Desired
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.trajectory_motion import load_trajectory
from modrob_cli.workflows.user_controller import load_user_controller

HOLD = """\
import numpy as np

class Hold:
    def __init__(self, task):
        self.n = task.model.dof
    def torque(self, t, q, dq, desired):
        {body}

def make_controller(task):
    return Hold(task)
"""


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(shipped_folder("assemblies") / "2r-side.yaml").robot


@pytest.fixture
def task(robot: Robot) -> ControlTask:
    trajectory = load_trajectory(shipped_folder("trajectories") / "spline-2r.yaml").trajectory
    return ControlTask(ControlModel(robot), trajectory, 1e-3, Control(gains={"kp": (5.0, 6.0), "kd": 2.0}))


def state() -> tuple[Array, Array, Desired]:
    q, dq = np.array([0.1, -0.7]), np.array([0.4, 0.5])
    return q, dq, Desired(np.array([0.2, -0.6]), np.array([0.3, 0.1]), np.array([1.0, 2.0]))


def write(folder: Path, text: str, name: str = "mine.py") -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


def body(folder: Path, line: str) -> str:
    """A controller whose torque() is this line, line 7 of its file."""
    return write(folder, HOLD.format(body=line))


def fault_of(name: str, task: ControlTask, t: float | None = None) -> str:
    """Message of loading or, with a time, of running a controller."""

    def run() -> None:
        controller = load_user_controller(name, task)
        if t is not None:
            controller.torque(t, *state())

    with pytest.raises(InputFileError) as caught:
        run()
    (fault,) = caught.value.faults
    return str(fault)


def test_the_shipped_example_is_gravity_and_pd(task: ControlTask, robot: Robot) -> None:
    controller = load_user_controller(str(shipped_folder("scenarios") / "my_controller.py"), task)
    q, dq, desired = state()
    rest = np.zeros((1, 2))
    gravity = rnea(robot, q[None], rest, rest)[0]
    wanted = gravity + np.array([5.0, 6.0]) * 0.1 + 2.0 * (desired.dq - dq)
    # Two independent recursions of a few dozen operations on torques of some 10 N m.
    np.testing.assert_allclose(controller.torque(0.0, q, dq, desired), wanted, rtol=1e-12, atol=1e-12)


def test_a_gain_that_it_does_not_know(task: ControlTask) -> None:
    other = ControlTask(task.model, task.trajectory, task.period, Control(gains={"kq": 1.0}))
    with pytest.raises(UsageError, match="found the gain kq, expected some of kp, kd"):
        load_user_controller(str(shipped_folder("scenarios") / "my_controller.py"), other)


def test_the_example_of_the_documentation(tmp_path: Path, task: ControlTask, robot: Robot) -> None:
    page = (Path(__file__).parents[2] / "docs" / "scenarios.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    q, dq, desired = state()
    found = load_user_controller(write(tmp_path, text), task).torque(0.0, q, dq, desired)
    planned = rnea(robot, *(part[None] for part in desired))[0]
    friction_free = planned + np.array([5.0, 6.0]) * (desired.q - q) + 2.0 * (desired.dq - dq)
    armature = task.model.armature * desired.ddq
    np.testing.assert_allclose(found, friction_free + armature, rtol=1e-12, atol=1e-12)


def test_everything_that_the_page_says_of_a_task_is_there(task: ControlTask) -> None:
    page = (Path(__file__).parents[2] / "docs" / "scenarios.md").read_text(encoding="utf-8")
    named = re.findall(r"`task\.([a-z_.]+)", page)
    assert {"period", "gain", "model.inverse_dynamics", "trajectory"} <= set(named)
    for name in named:
        found: Any = task
        for part in name.split("."):
            found = getattr(found, part)
    assert task.trajectory.sample(0.5, 2).shape == (3, 2)


def test_functions_and_classes_by_name(tmp_path: Path, task: ControlTask) -> None:
    name = body(tmp_path, "return [1, 2]")
    for suffix in ("", ":make_controller", ":Hold"):
        found = load_user_controller(name + suffix, task).torque(0.0, *state())
        np.testing.assert_array_equal(found, [1.0, 2.0])
        assert found.dtype == np.float64


def test_shipped_names_make_shipped_controllers(task: ControlTask) -> None:
    plain = ControlTask(task.model, task.trajectory, task.period, Control())
    assert type(load_user_controller("id", plain)).__name__ == "InverseDynamics"
    with pytest.raises(UsageError, match=r"found the controller 'pdi', expected .*pb-afc.* or a Python file"):
        load_user_controller("pdi", task)


def test_each_run_has_a_file_of_its_own(tmp_path: Path, task: ControlTask) -> None:
    text = "calls = []\n" + HOLD.format(body="calls.append(t); return np.full(2, len(calls))")
    name = write(tmp_path, text)
    for _ in range(2):
        assert load_user_controller(name, task).torque(0.0, *state())[0] == 1.0


def test_it_cannot_change_the_measurements(tmp_path: Path, task: ControlTask) -> None:
    line = "q *= 0; dq *= 0; [part.fill(9) for part in desired]; return q"
    q, dq, desired = state()
    load_user_controller(body(tmp_path, line), task).torque(0.0, q, dq, desired)
    for found, wanted in zip((q, dq, *desired), (*state()[:2], *state()[2]), strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_neighbours_can_be_imported_and_hide_nothing(
    tmp_path: Path, task: ControlTask, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    write(tmp_path, "import no_such_thing\n", "colorsys.py")  # as a module of Python that is not loaded yet
    write(tmp_path, "VALUE = 4.5\n", "modrob_test_neighbour.py")
    text = "import colorsys\nimport modrob_test_neighbour as n\n" + HOLD.format(body="return np.full(2, n.VALUE)")
    before = list(sys.path)
    found = load_user_controller(write(tmp_path, text), task).torque(0.0, *state())
    assert found[0] == 4.5
    assert sys.path == before
    del sys.modules["modrob_test_neighbour"]


def test_dataclasses_work(tmp_path: Path, task: ControlTask) -> None:
    text = (
        "from __future__ import annotations\nfrom dataclasses import dataclass, field\nfrom typing import ClassVar\n"
        "import numpy as np\n\n@dataclass\nclass C:\n    task: object\n    kind: ClassVar[int] = 3\n"
        "    gains: list[float] = field(default_factory=lambda: [1.0, 2.0])\n"
        "    def torque(self, t, q, dq, desired):\n        return np.array(self.gains)\n"
    )
    np.testing.assert_array_equal(load_user_controller(write(tmp_path, text) + ":C", task).torque(0, *state()), [1, 2])


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("x = 1\ndef f(:\n", "mine.py:2:7", "not valid Python: invalid syntax"),
        ("x = 1\n    y = 2\n", "mine.py:2", "not valid Python: unexpected indent"),
        ("x = 1\x00\n", "mine.py", "not valid Python"),
        ("x = " + "(" * 3000, "mine.py:1", "not valid Python: too many nested parentheses"),
        ("x = " + "-" * 100_000 + "1", "mine.py", "not valid Python"),
        ("x = 1\n\nx / 0\n", "mine.py:3", "ZeroDivisionError: division by zero (while it was loaded)"),
        ("import modrob_no_such_module\n", "mine.py:1", "No module named 'modrob_no_such_module'"),
        ("def f():\n    raise KeyError('a')\n\nf()\n", "mine.py:2", "KeyError: 'a'"),
        ("import json\n\njson.loads('{')\n", "mine.py:3", "JSONDecodeError"),
        ("import sys\nsys.exit(0)\n", "mine.py:2", "SystemExit: 0"),
        ("def make_controler(task): ...\n", "mine.py", "did you mean FILE.py:make_controler?"),
        ("import numpy as np\nclass Pd: ...\n", "mine.py", "it defines Pd; another one is named with FILE.py:NAME"),
        ("", "mine.py", "make_controller is missing, expected 'def make_controller(task)'; it defines no function"),
        ("make_controller = 3\n", "mine.py", "found make_controller of type int, expected a function or class"),
        ("x = 1\ndef make_controller(): ...\n", "mine.py:2", "takes 0 positional arguments but 1 was given"),
        ("def make_controller(task):\n    return 1 / 0\n", "mine.py:2", "(while the controller was made)"),
        ("\n\ndef make_controller(task):\n    pass\n", "mine.py:3", "of type NoneType without a method torque"),
        ("class C:\n    torque = 3\ndef make_controller(task):\n    return C()\n", "mine.py:3", "of type C without"),
        ("class make_controller:\n    pass\n", "mine.py", "takes no arguments"),
        ("\nclass make_controller:\n    def __init__(self): ...\n", "mine.py:3", "takes 1 positional argument"),
        ("def make_controller(task):\n    raise ValueError('\\x1b[31m' + 'a' * 9999)\n", "mine.py:2", "\\x1b[31maaa"),
    ],
)  # fmt: skip
def test_faults_of_files(tmp_path: Path, task: ControlTask, text: str, place: str, message: str) -> None:
    found = fault_of(write(tmp_path, text), task)
    assert found.startswith(f"{tmp_path / place}")
    assert message in found
    assert "\x1b" not in found
    assert len(found) < 900


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("return 1 / 0", "ZeroDivisionError: division by zero (at t = 0.25 s)"),
        ("return np.linalg.inv(np.zeros((2, 2)))", "LinAlgError: Singular matrix (at t = 0.25 s)"),
        ("return self.gain * q", "has no attribute 'gain'"),
        ("raise SystemExit", "SystemExit (at t = 0.25 s)"),
        ("return self.torque(t, q, dq, desired)", "RecursionError"),
        ("class E(Exception):\n            def __str__(self): return 1 / 0\n        raise E", "E: an exception"),
        ("return np.array([np.nan, 1.0])", "torque gave J.1: nan; expected finite numbers (at t = 0.25 s)"),
        ("return [float('inf')] * 2", "torque gave J.1: inf, J#2.1: inf"),
        ("return np.zeros(3)", "torque gave an array of shape (3,), expected (2,), one per joint"),
        ("return np.zeros((2, 1))", "shape (2, 1)"),
        ("return 0.0", "shape ()"),
        ("q + dq", "torque gave nothing; is a return missing?"),
        ("return ['1', '2']", "torque gave values of type <U1, expected 2 real numbers"),
        ("return [None, 1.0]", "torque gave values of type object"),
        ("return q + 1j", "torque gave values of type complex128"),
        ("return [1.0, [2.0, 3.0]]", "torque gave no array (ValueError"),
    ],
)  # fmt: skip
def test_faults_while_running(tmp_path: Path, task: ControlTask, line: str, message: str) -> None:
    found = fault_of(body(tmp_path, line), task, t=0.25)
    assert message in found
    number = re.match(r".*mine\.py:(\d+): ", found)
    assert number is not None
    raised = not message.startswith(("torque", "shape"))
    expected = {9, 8} if "class E" in line else {7} if raised else {6}  # 6: where torque begins
    assert int(number[1]) in expected


def test_a_torque_of_other_arguments(tmp_path: Path, task: ControlTask) -> None:
    name = write(tmp_path, HOLD.format(body="pass").replace("t, q, dq, desired", "t"))
    assert fault_of(name, task, t=0.0).startswith(f"{tmp_path / 'mine.py'}:6: TypeError")


def test_missing_gains_are_told_as_the_task_does(tmp_path: Path, task: ControlTask) -> None:
    with pytest.raises(UsageError, match="the gain stiffness is missing"):
        load_user_controller(write(tmp_path, "def make_controller(task):\n    task.gain('stiffness')\n"), task)
    text = HOLD.format(body="return self.task.gain('stiffness')").replace("self.n", "self.task = task; self.n")
    controller = load_user_controller(write(tmp_path, text), task)
    with pytest.raises(UsageError, match="the gain stiffness is missing"):
        controller.torque(0.0, *state())


def test_an_interrupt_from_the_keyboard_passes(tmp_path: Path, task: ControlTask) -> None:
    controller = load_user_controller(body(tmp_path, "raise KeyboardInterrupt"), task)
    with pytest.raises(KeyboardInterrupt):
        controller.torque(0.0, *state())


def test_files_that_cannot_be_read(tmp_path: Path, task: ControlTask) -> None:
    (tmp_path / "folder.py").mkdir()
    (tmp_path / "latin.py").write_bytes(b"# caf\xe9\n")
    assert "none.py: file not found" in fault_of(str(tmp_path / "none.py"), task)
    assert "found a folder, expected a file" in fault_of(str(tmp_path / "folder.py"), task)
    assert "latin.py:1: found the byte 0xe9, expected UTF-8" in fault_of(str(tmp_path / "latin.py"), task)


def test_names_of_files() -> None:
    assert controller_file("id") is None
    assert controller_file("a.pyc") is None
    assert controller_file("a/b.py") == (Path("a/b.py"), "make_controller")
    assert controller_file("a/b.py:C") == (Path("a/b.py"), "C")
    assert controller_file("C:/a/b.py") == (Path("C:/a/b.py"), "make_controller")
    assert controller_file("a.py:b.py") == (Path("a.py:b.py"), "make_controller")
    for name in ("a.py:", "a.py:1", "a.py:a-b", "a.py:a b"):
        with pytest.raises(UsageError, match="expected FILE.py or FILE.py:NAME"):
            controller_file(name)
