"""The shipped catalogue against what it was taken from.

Sources: [D] Tables 3.2 with (3.41) to (3.43) (planar arm), 3.4 (LWA 4P), 4.1 and 4.2 (reconfigurable arm); [R] Tables I
and II. Bodies and frames are placed by hand or by closed form here.
"""

from pathlib import Path

import numpy as np
import pytest

from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.link_parameters import link_parameters
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics
from modrob_cli.interval import Interval
from modrob_cli.io.documents import check_document
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.io.yaml_loader import load_yaml
from modrob_cli.model.module import Module
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.schema import ModuleDocument
from modrob_cli.workflows.robots import load_robot

MODULES, ASSEMBLIES = shipped_folder("modules"), shipped_folder("assemblies")
DOCUMENTS = sorted([*MODULES.rglob("*.yaml"), *ASSEMBLIES.glob("*.yaml")])


def module(folder: str, name: str) -> Module:
    document = check_document(load_yaml(MODULES / folder / f"{name}.yaml"), ModuleDocument)
    assert isinstance(document, ModuleDocument)
    return document.to_model()


def arm(name: str) -> Robot:
    return load_robot(ASSEMBLIES / f"{name}.yaml").robot


def quantities(part: Module) -> list[Uncertain]:
    bodies = [output.body for output in part.outputs.values()]
    out = []
    for unit in part.units:
        bodies += [unit.proximal.body, unit.distal.body]
        out += [unit.joint.friction.viscous, unit.joint.friction.coulomb, unit.joint.drive.rotor_inertia]
    return out + [value for body in bodies for value in (body.mass, body.com, body.inertia)]


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_document_is_named_after_its_file_and_says_where_it_is_from(path: Path) -> None:
    document = check_document(load_yaml(path))
    assert document.name == path.stem  # type: ignore[attr-defined]
    if path.is_relative_to(MODULES):
        assert document.source  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["PB1", "PB2", "PB3", "PB4", "L1", "L2", "L3", "L4", "L5", "L6", "L7"])
def test_five_percent_catalogue_is_the_published_one_with_bounds(name: str) -> None:
    plain, wide = module("schunk-lwa4p", name), module("schunk-lwa4p-tol5", name)
    for value, exact in zip(quantities(wide), quantities(plain), strict=True):
        np.testing.assert_array_equal(value.nominal, exact.nominal)
        half = 0.05 * np.abs(exact.nominal)
        # one rounding outward beyond the double nearest to 5 %
        np.testing.assert_allclose(value.interval.sup, exact.nominal + half, rtol=1e-15)
        np.testing.assert_allclose(value.interval.inf, exact.nominal - half, rtol=1e-15)
    for key, output in plain.outputs.items():
        np.testing.assert_array_equal(wide.outputs[key].transform, output.transform)
    for unit, other in zip(plain.units, wide.units, strict=True):
        np.testing.assert_array_equal(unit.distal.transform, other.distal.transform)
        assert unit.joint.limits == other.joint.limits


def test_peak_torques_are_what_the_currents_give() -> None:
    # Timor's peak torque = torque constant x gear ratio x current limit of the MATLAB data base: 75.504 and 40 N m
    for name in ("PB1", "PB2", "PB3", "PB4"):
        for unit in module("schunk-lwa4p", name).units:
            drive, limits = unit.joint.drive, unit.joint.limits
            assert drive.torque_constant is not None
            assert limits.current is not None
            assert limits.torque is not None
            given = drive.torque_constant * drive.gear_ratio * limits.current[1]
            assert limits.torque[1] == pytest.approx(given, rel=1e-12)


def test_printed_table_agrees_with_the_modules() -> None:
    # [D] Table 3.4 prints the numbers of the synthesis, rounded: lengths to 0.5 mm, tensors to 0.05e-3 kg m^2
    robots = arm("lwa4p-table34"), arm("lwa4p-6")
    printed, built = (link_parameters(robot, dh_table(robot).frames) for robot in robots)
    np.testing.assert_allclose(printed.mass, built.mass, atol=1e-15)
    np.testing.assert_allclose(printed.com, built.com, atol=5.1e-4)
    np.testing.assert_allclose(printed.inertia_com, built.inertia_com, atol=5.1e-5)
    q = np.random.default_rng(1).uniform(-2, 2, (20, 6))
    np.testing.assert_allclose(robots[0].link_frames(q)[:, -1], robots[1].link_frames(q)[:, -1], atol=2.1e-4)  # d_6
    for joint, other in zip(robots[0].joints, robots[1].joints, strict=True):
        assert joint.limits == other.limits
        assert repr(joint.drive) == repr(other.drive)  # repr shows every digit
        assert repr(joint.friction) == repr(other.friction)


def test_uncertain_last_links_of_the_published_arms() -> None:
    last = {body.body.name: body.body for body in arm("lwa4p-table34").bodies}["link6"]
    np.testing.assert_array_equal([last.mass.interval.inf, last.mass.interval.sup], [1.5, 3.0])
    assert (last.com.nominal[2], last.com.interval.inf[2], last.com.interval.sup[2]) == (-0.042, -0.042, 0.042)
    np.testing.assert_allclose(last.inertia.interval.sup, 2 * last.inertia.nominal)
    link6 = {body.body.name: body.body for body in arm("lwa4p-rtable1").bodies}["link6"]
    # true values of both scenarios of [R] Table II
    for mass, com, inertia in (
        (2.1, (0, 0, 0.06), (2.54, 0, 0, 5.3, 0, 4.73)),
        (2.8, (0.005, 0.005, 0.1), (3.4, 0, 0, 7.0, 0, 6.3)),
    ):
        assert link6.mass.interval.contains(mass)
        assert np.all(link6.com.interval.contains(com))
        assert np.all(link6.inertia.interval.contains(1e-3 * np.array(inertia)))


def planar_torque(q: Array, dq: Array, ddq: Array, m2: float, i2: float, c2: float) -> Array:
    """[D] (3.41) to (3.43), with m1 lc1^2 where the print has m1 lc1."""
    m1, i1, c1, length, g = 10.0, 10 / 12, 0.5, 1.0, 9.81
    h = length * c2 * np.cos(q[1])
    m11 = i1 + i2 + m1 * c1**2 + m2 * (length**2 + c2**2 + 2 * h)
    m12, m22 = i2 + m2 * (c2**2 + h), i2 + m2 * c2**2
    s = m2 * length * c2 * np.sin(q[1])
    coriolis = np.array([-s * dq[1] * dq[0] - s * (dq[0] + dq[1]) * dq[1], s * dq[0] ** 2])
    g2 = m2 * c2 * g * np.cos(q[0] + q[1])
    gravity = np.array([(m1 * c1 + m2 * length) * g * np.cos(q[0]) + g2, g2])
    return np.asarray(np.array([[m11, m12], [m12, m22]]) @ ddq + coriolis + gravity)


def test_planar_arm_has_the_published_dynamics() -> None:
    robot = arm("planar-2r")
    rng = np.random.default_rng(2)
    for q, dq, ddq in rng.uniform(-3, 3, (50, 3, 2)):
        expected = planar_torque(q, dq, ddq, m2=5.0, i2=10 / 12, c2=0.5)
        np.testing.assert_allclose(inverse_dynamics(robot, q, dq, ddq), expected, rtol=1e-12, atol=1e-12)
    second = robot.bodies_of(2)[-1].body
    assert second.mass.interval.encloses(Interval(5.0, 10.0))
    assert second.com.interval[0].encloses(Interval(0.5, 0.525))
    assert second.inertia.interval[5].encloses(Interval(10 / 12, 25 / 12))


def test_connectors_of_the_reconfigurable_link() -> None:
    # [D] Figure 4.5a: A above, C below, B and D to the sides, all H3 away; H1 = 0.03, H3 = 0.3, H4 = 0.06
    outputs = module("reconfigurable-2r", "L").outputs
    places = {"outA": (0.3, 0, 0.06), "outB": (0.3, 0.03, 0.03), "outC": (0.3, 0, 0), "outD": (0.3, -0.03, 0.03)}
    axes = {"outA": (0, 0, 1), "outB": (0, 1, 0), "outC": (0, 0, -1), "outD": (0, -1, 0)}
    for key, output in outputs.items():
        np.testing.assert_allclose(output.transform[:3, 3], places[key], atol=1e-15)
        np.testing.assert_allclose(output.transform[:3, 2], axes[key], atol=1e-15)


def test_reconfigurable_arms_differ_by_their_connectors() -> None:
    axes = {}
    for name in ("2r-in-line", "2r-side", "2r-folded"):
        frames = arm(name).link_frames(np.zeros(2))
        axes[name] = float(frames[0, :3, 2] @ frames[1, :3, 2])
    np.testing.assert_allclose([axes["2r-in-line"], axes["2r-side"], axes["2r-folded"]], [1, 0, -1], atol=1e-15)


def test_scara_moves_down_and_stays_level() -> None:
    robot = arm("scara")
    assert [joint.type for joint in robot.joints] == ["revolute", "revolute", "prismatic", "revolute"]
    q = np.array([[0.3, -0.8, 0.0, 0.4], [0.3, -0.8, 0.18, 0.4]])
    high, low = robot.link_frames(q)[:, -1]
    np.testing.assert_allclose(low[:3, 3] - high[:3, 3], [0, 0, -0.18], atol=1e-15)
    np.testing.assert_allclose(low[:3, 2], [0, 0, -1], atol=1e-15)
    # heights: column 0.3, shoulder 0.1 + 0.02, elbow 0.08 + 0.02, then down: quill 0.1, wrist 0.03, cup 0.05
    assert high[2, 3] == pytest.approx(0.3 + 0.12 + 0.1 - 0.18, abs=1e-15)
    # reach: arms of 0.25 and 0.2, turned by 0.3 and -0.8
    reach = 0.25 * np.exp(0.3j) + 0.2 * np.exp(-0.5j)
    np.testing.assert_allclose(high[:2, 3], [reach.real, reach.imag], atol=1e-15)


@pytest.mark.parametrize(
    ("name", "axes", "mass"),
    [
        ("lwa4p-4", 4, 3.9 + 1.62 + 3.9 + 1.4),
        ("lwa4p-4-balls", 4, 7.8),
        ("lwa4p-6", 6, 3.9 + 1.62 + 3.9 + 1.0 + 1.9 + 1.4),
        ("lwa4p-6-compact", 6, 7.8 + 1.0 + 1.9 + 1.4),
        ("lwa4p-6-printed", 6, 7.8 + 0.19 + 0.17 + 1.9 + 1.4),
        ("lwa4p-6-extended", 6, 7.8 + 1.62 + 1.0 + 0.15 + 0.19 + 1.9 + 1.4),
        ("lwa4p-6-payload", 6, 13.72 + 0.5),
        ("lwa4p-8", 8, 3 * 3.9 + 1.62 + 1.0 + 0.15 + 1.9 + 1.4),
    ],
)
def test_arms_carry_what_their_modules_weigh(name: str, axes: int, mass: float) -> None:
    robot = arm(name)
    assert robot.dof == axes
    assert sum(float(placed.body.mass.nominal) for placed in robot.bodies) == pytest.approx(mass, rel=1e-12)
