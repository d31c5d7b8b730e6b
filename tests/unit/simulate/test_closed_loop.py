"""Plant, sensors and controller together: clocks, saturation, energy, what is recorded, and bad input."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import torque_limits
from modrob_cli.dynamics.pinocchio_backend import build_model
from modrob_cli.errors import NumericalError, UsageError
from modrob_cli.model.joint import Drive, Limits
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Channel, Contact, Control, Scenario, Sensors, Truth
from modrob_cli.model.trajectory import Trajectory
from modrob_cli.model.trajectory_curves import SineCurve
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.simulate.closed_loop import ClosedLoop
from modrob_cli.simulate.controllers.interface import Controller, Desired
from modrob_cli.simulate.recording import Run
from modrob_cli.simulate.steps import State
from modrob_cli.simulate.truth import true_robot
from tests.unit.simulate.arms import body, plant_of, run, shipped, slider, with_friction, without_friction


class Given:
    """Torques as a function of the number of the call; remembers its calls."""

    def __init__(self, torques: Array) -> None:
        self.torques = torques
        self.calls: list[tuple[float, Array, Array, Desired]] = []

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        self.calls.append((t, q.copy(), dq.copy(), desired))
        return np.asarray(self.torques[len(self.calls) - 1])


class Pd:
    """A spring and a damper to the desired motion, with gains for each joint."""

    def __init__(self, kp: float, kd: float) -> None:
        self.kp, self.kd = kp, kd

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        return self.kp * (desired.q - q) + self.kd * (desired.dq - dq)


def sines(dof: int, duration: float = 1.0, amplitude: float = 0.3) -> Trajectory:
    def curve(k: int) -> SineCurve:
        return SineCurve(duration, 0.05, np.array([amplitude]), np.array([3.0 + k]), np.array([0.4 * k]))

    return Trajectory("sines", tuple(curve(k) for k in range(dof)))


def simulate(robot: Robot, controller: Controller, scenario: Scenario, duration: float = 1.0, seed: int = 0) -> Run:
    truth = true_robot(robot, scenario.truth, np.random.default_rng(seed), scenario.payload)
    rng = np.random.default_rng(seed + 1)
    loop = ClosedLoop(robot, truth, sines(robot.dof, duration), controller, scenario, np.ones(robot.dof), rng)
    return loop.run()


def test_commands_are_held_and_samples_are_those_of_the_plant() -> None:
    # the same commands given to the plant step by step; 200 Hz commands, 50 Hz samples
    robot = shipped("lwa4p-6")
    torques = np.random.default_rng(2).uniform(-30.0, 30.0, (201, 6))
    controller = Given(torques)
    scenario = Scenario(control=Control(rate=200.0), sensors=Sensors(rate=50.0), sub_steps=3, saturation=False)
    recording = simulate(robot, controller, scenario).recording
    assert recording.t == pytest.approx(np.arange(51) / 50.0, abs=1e-15)
    plant = plant_of(robot)
    first = sines(6).sample(0.0, 2)
    state = plant.start(first[0], first[1])
    for k in range(200):
        if k % 4 == 0:
            assert recording.values["q"][k // 4] == pytest.approx(state.q, abs=1e-12)
            assert recording.values["dq"][k // 4] == pytest.approx(state.dq, abs=1e-11)
            assert recording.values["ddq"][k // 4] == pytest.approx(plant.accelerations(state, torques[k]), abs=1e-9)
            assert np.array_equal(recording.values["applied"][k // 4], torques[k])
            # the motor still gives the torque of the command before
            assert np.array_equal(recording.values["effort"][k // 4], torques[max(k - 1, 0)])
        run(plant, state, torques[k], (k + 1) / 200.0, 1.0 / 600.0)
    assert [call[0] for call in controller.calls] == pytest.approx(np.arange(201) / 200.0, abs=1e-15)
    assert np.array([call[3].ddq for call in controller.calls]) == pytest.approx(
        sines(6).sample(np.arange(201) / 200.0, 2)[:, 2]
    )


def test_what_is_recorded_fulfils_the_equation_of_motion() -> None:
    # Pinocchio's inverse dynamics of the true robot against motor, friction and contacts, at every sample
    robot = with_friction(shipped("lwa4p-6"), 1.5, 2.0)
    push = Contact("push", 6, np.array([0.0, 0.02, 0.1]), np.array([20.0, -30.0, 10.0]), 0.3, 0.4)
    found = simulate(robot, Pd(300.0, 30.0), Scenario(contacts=(push,)))
    v, model = found.recording.values, build_model(found.truth.robot)
    model.armature = np.array([float(j.drive.gear_ratio**2 * j.drive.rotor_inertia.nominal) for j in robot.joints])
    data = model.createData()
    moving = np.array([pin.rnea(model, data, *row) for row in zip(v["q"], v["dq"], v["ddq"], strict=True)])
    assert np.abs(v["applied"] + v["external"] - v["friction"] - moving).max() < 1e-10
    slides = v["dq"] != 0.0
    assert v["friction"][slides] == pytest.approx((1.5 * v["dq"] + 2.0 * np.sign(v["dq"]))[slides], abs=1e-9)
    assert (~slides).any()
    assert (np.abs(v["friction"][~slides]) <= 2.0 + 1e-9).all()
    t = found.recording.t
    inside = (t > 0.3 - 1e-9) & (t < 0.7 - 1e-9)
    assert np.abs(v["external"][inside]).max(axis=1).min() > 0.1
    assert not v["external"][~inside].any()
    # accelerations are those of the velocities, where the torque is held and nothing jumps
    mean = np.diff(v["dq"], axis=0) / 1e-3
    smooth = (np.sign(v["dq"][1:]) == np.sign(v["dq"][:-1])) & slides[1:]
    assert np.median(np.abs(mean - v["ddq"][:-1])[smooth]) < 0.05


def test_the_energy_balances_with_friction_contacts_saturation_and_stops() -> None:
    limits = Limits(position=(-0.2, 0.25), torque=(-30.0, 30.0))
    robot = with_friction(shipped("lwa4p-6"), 0.5, 1.5)
    joints = tuple(replace(joint, limits=limits) if k in (1, 3) else joint for k, joint in enumerate(robot.joints))
    push = Contact("push", 6, np.zeros(3), np.array([20.0, -30.0, 10.0]), 0.3123, 0.2, "link", "half-sine")
    errors = []
    for steps in (1, 2, 4):
        scenario = Scenario(contacts=(push,), sub_steps=steps, initial_q=np.full(6, 0.1), initial_dq=np.zeros(6))
        found = simulate(replace(robot, joints=joints), Pd(300.0, 5.0), scenario)
        assert found.hits
        assert found.saturated[[1, 3]].max() > 0.0
        errors.append(found.energy_error)
    assert max(errors) < 1e-6
    assert errors[2] < 1e-8


def test_saturation() -> None:
    robot = slider(2.0)
    drive = Drive(gear_ratio=10.0, torque_constant=0.5)
    joint = replace(robot.joints[0], limits=Limits(torque=(-8.0, 9.0), current=(-1.0, 2.0)), drive=drive)
    robot = replace(robot, joints=(joint,))
    assert [float(end[0]) for end in torque_limits(robot)] == [-5.0, 9.0]
    torques = np.tile([[20.0], [-20.0], [3.0], [9.0]], (251, 1))
    found = simulate(robot, Given(torques), Scenario())
    applied = found.recording.values["applied"][:4, 0]
    assert applied.tolist() == [9.0, -5.0, 3.0, 9.0]
    assert found.recording.values["commanded"][:2, 0].tolist() == [20.0, -20.0]
    assert found.saturated[0] == pytest.approx(0.5, abs=1e-3)
    assert simulate(robot, Given(torques), Scenario(saturation=False)).saturated[0] == 0.0


@pytest.mark.parametrize("noise", ["gaussian", "uniform"])
def test_same_seed_same_bits(noise: str) -> None:
    robot = shipped("lwa4p-6-tol5")
    channel = Channel(1e-4, 1e-5)
    sensors = Sensors(500.0, channel, channel, channel, noise, "differentiated", delay=0.003, jitter=1e-4)  # type: ignore[arg-type]
    scenario = Scenario(truth=Truth("uniform"), sensors=sensors, payload=body(1.0, (0.0, 0.0, 0.1), 0.002))
    found = [simulate(robot, Pd(200.0, 20.0), scenario, 0.2, seed).recording for seed in (1, 1, 2)]
    for key, values in found[0].values.items():
        assert values.tobytes() == found[1].values[key].tobytes()
        assert values.shape == found[0].values["q"].shape
    assert found[0].stamps.tobytes() == found[1].stamps.tobytes()
    assert found[0].values["q"].tobytes() != found[2].values["q"].tobytes()


def test_the_controller_gets_late_samples() -> None:
    controller = Given(np.zeros((101, 1)))
    scenario = Scenario(sensors=Sensors(rate=250.0, delay=0.009), control=Control(rate=1000.0))
    found = simulate(slider(1.0), controller, scenario, 0.1)
    q = found.recording.values["q"][:, 0]
    for k, (_, seen, _, _) in enumerate(controller.calls):
        assert seen[0] == q[max(k // 4 - 3, 0)]  # 9 ms are 3 samples of 4 ms


def test_a_loop_that_runs_away_ends() -> None:
    found = simulate(without_friction(shipped("lwa4p-6")), Pd(-1e5, -1e3), Scenario(saturation=False))
    assert found.diverged is not None
    assert 0.0 < found.diverged < 1.0
    assert len(found.recording.t) == len(found.recording.values["q"]) == round(found.diverged * 1000.0)
    assert np.isfinite(found.recording.values["q"]).all()


@pytest.mark.parametrize("size", [1e12, 1e300, np.inf, np.nan])
@pytest.mark.parametrize("name", ["scara", "planar-2r"])
def test_absurd_torques_end_the_run(name: str, size: float) -> None:
    robot = shipped(name)
    torques = np.zeros((1001, robot.dof))
    torques[10:] = size
    scenario = Scenario(saturation=False, end_stops=name == "scara", initial_q=np.full(robot.dof, 0.1))
    found = simulate(robot, Given(torques), scenario)
    # between end stops a joint cannot run away: it comes to lie on one
    assert found.diverged is not None or name == "scara" and np.isfinite(size)
    assert found.diverged is None or 0.009 < found.diverged < 0.2
    assert np.isfinite(found.recording.values["q"]).all()


def test_progress_is_told() -> None:
    told: list[float] = []
    robot = slider(1.0)
    truth = true_robot(robot, Truth(), np.random.default_rng(0))
    rng = np.random.default_rng(0)
    ClosedLoop(robot, truth, sines(1), Pd(1.0, 1.0), Scenario(), np.ones(1), rng).run(told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert 100 < len(told) < 300


class Wrong:
    def __init__(self, result: object) -> None:
        self.result = result

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        return self.result  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("result", "message"),
    [(np.zeros(2), r"shape \(2,\), expected 1"), (0.0, r"shape \(\)"), ("abc", "failed at t = 0 s"), (None, "shape")],
)
def test_a_controller_that_gives_no_torques_is_named(result: object, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        simulate(slider(1.0), Wrong(result), Scenario())


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        (Scenario(sensors=Sensors(rate=300.0)), "sensors at 300 Hz and a controller at 1000 Hz"),
        (Scenario(sensors=Sensors(rate=2000.0)), "multiple"),
        (Scenario(control=Control(rate=1e9)), "1e.09 commands in one run"),
        (Scenario(initial_q=np.zeros(2)), "initial q: found .* expected 1 finite"),
        (Scenario(initial_dq=np.array([np.nan])), "initial dq: found .nan. expected 1 finite|initial dq: found"),
        (Scenario(initial_q=np.array([0.6])), r"joint j would start at 0\.6, beyond its limits -0\.5 \.\. 0\.5"),
        (Scenario(sensors=Sensors(position=Channel((1.0, 1.0)))), "position: found 2 values for 1 joints"),
    ],
)
def test_bad_scenarios_are_named(scenario: Scenario, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        simulate(slider(1.0, position=(-0.5, 0.5)), Pd(1.0, 1.0), scenario)


def test_friction_too_stiff_for_the_step_is_named() -> None:
    # m = 1, b = 5000: time constant of 0.2 ms against steps of 1 ms
    robot = slider(1.0, viscous=5000.0)
    with pytest.raises(UsageError, match="sub_steps: found 1, .* expected 5 or more"):
        simulate(robot, Pd(1.0, 1.0), Scenario())
    assert simulate(robot, Pd(1.0, 1.0), Scenario(sub_steps=5)).diverged is None


def test_arms_without_inertia_are_named() -> None:
    with pytest.raises(NumericalError, match="no inertia acts on j; every joint needs"):
        simulate(slider(0.0), Pd(1.0, 1.0), Scenario())
    # the second axis coincides with the first, and nothing sits between them
    robot = shipped("planar-2r")
    second = replace(robot.joints[1], placement=np.eye(4))
    hollow = tuple(placed for placed in robot.bodies if placed.link == 2)
    with pytest.raises(NumericalError, match="singular"):
        simulate(replace(robot, joints=(robot.joints[0], second), bodies=hollow), Pd(1.0, 1.0), Scenario())


def test_the_true_robot_counts_and_not_the_nominal_one() -> None:
    robot = shipped("planar-2r")
    index = next(k for k, placed in enumerate(robot.bodies) if placed.body.name == "link2")
    heavy = Scenario(truth=Truth(bodies={"link2": {"mass": np.array(10.0)}}))
    found = simulate(robot, Given(np.zeros((1001, 2))), heavy)
    assert float(found.truth.robot.bodies[index].body.mass.nominal) == 10.0
    changed = replace(robot.bodies[index].body, mass=Uncertain.exact(10.0))
    bodies = list(robot.bodies)
    bodies[index] = replace(bodies[index], body=changed)
    plant = plant_of(replace(robot, bodies=tuple(bodies)))
    first = sines(2).sample(0.0, 2)
    state: State = run(plant, plant.start(first[0], first[1]), np.zeros(2), 1.0, 1e-3)
    assert found.recording.values["q"][-1] == pytest.approx(state.q, abs=1e-10)


def test_bodies_that_cannot_be_real_are_named() -> None:
    robot = slider(1.0)
    placed = robot.bodies[0]
    inverted = replace(placed.body, inertia=Uncertain.exact(np.array([-1.0, 0.0, 0.0, -1.0, 0.0, -1.0])))
    with pytest.raises(NumericalError, match="mass and inertia of body are not those of a real body"):
        simulate(replace(robot, bodies=(replace(placed, body=inverted),)), Pd(1.0, 1.0), Scenario())
