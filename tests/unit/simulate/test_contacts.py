"""Contact forces against virtual work, and when they act."""

import numpy as np
import pytest

from modrob_cli.model.scenario import Contact, ContactFrame
from tests.unit.simulate.arms import plant_of, run, shipped, slider, without_friction

FORCE, POINT = np.array([3.0, -7.0, 11.0]), np.array([0.11, -0.05, 0.2])


@pytest.mark.parametrize("name", ["lwa4p-6", "scara", "planar-2r"])
@pytest.mark.parametrize("frame", ["base", "link"])
def test_joint_torques_do_the_work_of_the_force(name: str, frame: ContactFrame) -> None:
    robot = without_friction(shipped(name))
    rng, d = np.random.default_rng(6), 1e-6
    for link in range(1, robot.dof + 1):
        plant = plant_of(robot, (Contact("c", link, POINT, FORCE, 0.0, 1.0, frame),))
        q = rng.uniform(-0.1, 2.0, robot.dof)
        steps = np.concatenate([q + d * np.eye(robot.dof), q - d * np.eye(robot.dof), q[None]])
        frames = robot.link_frames(steps)[:, link - 1]
        points = frames[:, :3, :3] @ POINT + frames[:, :3, 3]
        force = FORCE if frame == "base" else frames[-1, :3, :3] @ FORCE
        work = (points[: robot.dof] - points[robot.dof : -1]) @ force / (2.0 * d)
        assert plant.external_torque(0.5, q, 1e-3) == pytest.approx(work, abs=1e-7)  # differences of d = 1e-6


def test_forces_on_the_base_move_nothing() -> None:
    robot = shipped("lwa4p-6")
    plant = plant_of(robot, (Contact("c", 0, POINT, FORCE, 0.0, 1.0),))
    assert not plant.external_torque(0.5, np.ones(6), 1e-3).any()


def test_forces_add_up_within_their_windows() -> None:
    push = Contact("push", 1, np.zeros(3), np.array([2.0, 0.0, 0.0]), 0.1, 0.3)
    hit = Contact("hit", 1, np.zeros(3), np.array([5.0, 0.0, 0.0]), 0.2, 0.4, shape="half-sine")
    plant = plant_of(slider(1.0), (push, hit))

    def force(t: float) -> float:
        return float(plant.external_torque(t, np.zeros(1), 1e-3)[0])

    assert [force(t) for t in (0.0, 0.0999, 0.1, 0.15)] == pytest.approx([0.0, 0.0, 2.0, 2.0])
    assert force(0.3) == pytest.approx(2.0 + 5.0 * np.sin(np.pi / 4.0))
    assert force(0.4) == pytest.approx(5.0)
    assert force(0.5) == pytest.approx(5.0 * np.sin(3.0 * np.pi / 4.0))
    assert force(0.6) == force(0.7) == 0.0


@pytest.mark.parametrize("h", [1e-3, 0.7e-3, 0.013, 0.5])
def test_impulses_do_not_depend_on_the_step(h: float) -> None:
    # constant push: F T / m; half a sine: 2 F T / (pi m); windows off the grid, several within one step
    contacts = (
        Contact("a", 1, np.zeros(3), np.array([2.0, 0.0, 0.0]), 0.10037, 0.2),
        Contact("b", 1, np.zeros(3), np.array([5.0, 0.0, 0.0]), 0.20001, 0.05, shape="half-sine"),
        Contact("c", 1, np.zeros(3), np.array([-3.0, 0.0, 0.0]), 0.4, 1e-5),
    )
    plant = plant_of(slider(2.0), contacts)
    state = run(plant, plant.start(np.zeros(1), np.zeros(1)), np.zeros(1), 0.5, h)
    impulse = 2.0 * 0.2 + 5.0 * 0.05 * 2.0 / np.pi - 3.0 * 1e-5
    # steps as long as the half sine integrate it with Simpson's rule
    assert state.dq[0] == pytest.approx(impulse / 2.0, rel=1e-8 if h <= 1e-3 else 5e-2)


@pytest.mark.parametrize("shift", [0.0, 1e-16, -1e-16, 1e-13, -1e-13])
def test_windows_that_miss_the_grid_by_rounding(shift: float) -> None:
    push = Contact("push", 1, np.zeros(3), np.array([2.0, 0.0, 0.0]), 0.3 + shift, 0.2)
    plant = plant_of(slider(1.0), (push,))
    state = plant.start(np.zeros(1), np.zeros(1))
    run(plant, state, np.zeros(1), 0.6, 1e-3)
    assert state.dq[0] == pytest.approx(0.4, rel=1e-9)
    assert plant.external_torque(0.3, np.zeros(1), 1e-3)[0] == 2.0
    assert plant.external_torque(0.5 + 1e-12, np.zeros(1), 1e-3)[0] == 0.0
