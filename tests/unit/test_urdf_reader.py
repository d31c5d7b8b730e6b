"""URDF in: equal to Pinocchio's own reading of the same text; bad files end in clear errors."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from modrob_cli.arrays import Array
from modrob_cli.dynamics.pinocchio_backend import inverse_dynamics, tool_pose
from modrob_cli.errors import InputFileError
from modrob_cli.io.urdf_reader import read_urdf
from modrob_cli.model.robot import Robot
from tests.shared_data import shared

INERTIAL = (
    '<inertial><origin xyz="0.1 -0.2 0.05" rpy="0.3 0.2 -0.4"/><mass value="{mass}"/>'
    '<inertia ixx="0.2" ixy="0.01" ixz="0.02" iyy="0.3" iyz="-0.03" izz="0.25"/></inertial>'
)
LIMIT = '<limit effort="40" velocity="2" lower="-1" upper="1.5"/>'
Z = '<axis xyz="0 0 1"/>'


def link(name: str, mass: float = 1.5) -> str:
    return f'<link name="{name}">{INERTIAL.format(mass=mass)}</link>\n'


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = Z + LIMIT) -> str:
    origin = '<origin xyz="0.2 0.1 -0.3" rpy="0.5 -0.6 0.7"/>'
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{origin}{ends}{inside}</joint>\n'


def urdf(*parts: str) -> str:
    return '<?xml version="1.0"?>\n<robot name="arm">\n' + "".join(parts) + "</robot>\n"


def read(tmp_path: Path, text: str) -> Robot:
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    return read_urdf(path)


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(InputFileError) as caught:
        read(tmp_path, text)
    return str(caught.value)


def configuration(model: Any, q: Array) -> Array:
    """Joint positions in Pinocchio's form: (cos, sin) for joints without limits."""
    out: list[float] = []
    for index, value in enumerate(q):
        out.extend([value] if model.nqs[index + 1] == 1 else [np.cos(value), np.sin(value)])
    return np.array(out)


def assert_equal_to_pinocchio(robot: Robot, model: Any, tip: str) -> None:
    data = model.createData()
    samples = np.random.default_rng(3).uniform(-2.5, 2.5, (3, 40, robot.dof))
    for q, v, a in zip(*samples, strict=True):
        full = configuration(model, q)
        tau = pin.rnea(model, data, full, v, a)
        # 1e-10 is what the reader promises; the same numbers in turned frames differ by roundings only.
        np.testing.assert_allclose(inverse_dynamics(robot, q, v, a), tau, rtol=0, atol=1e-10)
        pin.framesForwardKinematics(model, data, full)
        pose = data.oMf[model.getFrameId(tip)].homogeneous
        np.testing.assert_allclose(tool_pose(robot, q), pose, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("name", "tip"), [("ur10", "tool0"), ("staubli_tx40", "tool0")])
def test_real_robots_equal_pinocchio(name: str, tip: str) -> None:
    path = shared(f"{name}/model.urdf")
    robot = read_urdf(path)
    model = pin.buildModelFromUrdf(str(path))
    assert robot.joint_names == tuple(model.names)[1:]
    assert_equal_to_pinocchio(robot, model, tip)


@pytest.mark.parametrize(
    "axis", ["1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 -1 0", "0 0 -1", "0.2 -0.5 0.7", "0 3 4", "1e-4 0 1"]
)
def test_odd_axes_fixed_joints_and_all_types_equal_pinocchio(tmp_path: Path, axis: str) -> None:
    moving = f'<axis xyz="{axis}"/>'
    text = urdf(
        *(link(name) for name in ("base", "plate", "l1", "l2", "flange", "l3", "hand", "camera")),
        joint("bolts", "base", "plate", "fixed", ""),
        joint("a", "plate", "l1", "revolute", moving + LIMIT),
        joint("b", "l1", "l2", "prismatic", moving + LIMIT),
        joint("weld", "l2", "flange", "fixed", ""),
        joint("c", "flange", "l3", "continuous", moving),
        joint("bracket", "l3", "camera", "fixed", ""),
        joint("grip", "l3", "hand", "fixed", ""),
    )
    robot = read(tmp_path, text)
    assert robot.joint_names == ("a", "b", "c")
    assert [item.type for item in robot.joints] == ["revolute", "prismatic", "revolute"]
    assert_equal_to_pinocchio(robot, pin.buildModelFromXML(text), "hand")


def test_axis_left_out_is_x(tmp_path: Path) -> None:
    text = urdf(link("a"), link("b"), joint("j", "a", "b", "revolute", LIMIT))
    assert_equal_to_pinocchio(read(tmp_path, text), pin.buildModelFromXML(text), "b")


def test_deepest_leaf_behind_the_last_joint_is_the_end_effector(tmp_path: Path) -> None:
    text = urdf(
        *(link(name) for name in ("base", "mast", "top", "tip", "l1", "hand", "finger")),
        joint("f1", "base", "mast", "fixed", ""),
        joint("f2", "mast", "top", "fixed", ""),
        joint("f3", "top", "tip", "fixed", ""),
        joint("j", "base", "l1"),
        joint("f4", "l1", "hand", "fixed", ""),
        joint("f5", "hand", "finger", "fixed", ""),
    )
    assert_equal_to_pinocchio(read(tmp_path, text), pin.buildModelFromXML(text), "finger")


def test_limits_and_friction_come_along(tmp_path: Path) -> None:
    inside = Z + LIMIT + '<dynamics damping="0.7" friction="0.2"/>'
    item = read(tmp_path, urdf(link("a"), link("b"), joint("j", "a", "b", inside=inside))).joints[0]
    assert item.limits.position == (-1.0, 1.5)
    assert item.limits.velocity == (-2.0, 2.0)
    assert item.limits.torque == (-40.0, 40.0)
    assert float(item.friction.viscous.nominal) == 0.7
    assert float(item.friction.coulomb.nominal) == 0.2


def test_limits_that_mean_none_are_none(tmp_path: Path) -> None:
    inside = Z + '<limit effort="0" velocity="1.7e308" lower="-1.7e308" upper="1.7e308"/>'
    limits = read(tmp_path, urdf(link("a"), link("b"), joint("j", "a", "b", inside=inside))).joints[0].limits
    assert limits.position is limits.velocity is limits.torque is None


def test_positions_of_a_continuous_joint_have_no_limit(tmp_path: Path) -> None:
    text = urdf(link("a"), link("b"), joint("j", "a", "b", "continuous"))
    assert read(tmp_path, text).joints[0].limits.position is None


def test_links_without_inertia_carry_no_body(tmp_path: Path) -> None:
    text = urdf('<link name="world"/>', '<link name="a"/>', link("b"), joint("j", "world", "a"), joint("k", "a", "b"))
    assert [(placed.link, placed.body.name) for placed in read(tmp_path, text).bodies] == [(2, "b")]


TWO = (link("a"), link("b"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot name='x'>\n<link", "arm.urdf:2:1: not well-formed"),
        ("", "not well-formed"),
        ("<sdf/>", "expected <robot>"),
        ('<!DOCTYPE robot [<!ENTITY a "b">]>\n<robot name="&a;"/>', "arm.urdf:1: found a document type"),
        ('<robot name="x" xmlns:xacro="y"><xacro:if/></robot>', "xacro FILE"),
        (urdf(), "no root link"),
        (urdf(*TWO, joint("j", "a", "b")).replace(' name="arm"', ""), "found no name"),
        (urdf(link("a")), "no moving joint"),
        (urdf(*TWO, joint("j", "a", "b", "floating", "")), "joint j: found the type 'floating'"),
        (urdf(*TWO, joint("j", "a", "b", "planar", "")), "joint j: found the type 'planar'"),
        (urdf(*TWO, joint("j", "a", "b", inside=Z)), "arm.urdf:5: joint j: <limit> is missing"),
        (urdf(*TWO, joint("j", "a", "b", inside=Z + LIMIT + '<mimic joint="j"/>')), "joint j: found <mimic>"),
        (urdf(*TWO, link("c"), joint("j", "a", "b"), joint("k", "a", "c")), "branch: the joints j, k"),
        (urdf(*TWO, link("c"), joint("j", "b", "c"), joint("k", "c", "b")), "loop: links b, c"),
        (urdf(*TWO, link("c"), joint("j", "a", "b")), "several root links: a, c"),
        (urdf(*TWO, joint("j", "a", "b"), joint("k", "a", "b")), "two parents: joints j and k"),
        (urdf(*TWO, joint("j", "a", "nowhere")), "child link 'nowhere' is not in the file"),
        (urdf(*TWO, *TWO, joint("j", "a", "b")), "found the link a again (first on line 3)"),
        (urdf(*TWO, joint("j", "a", "b"), joint("j", "a", "b")), "found the joint j again (first on line 5)"),
        (urdf(*TWO, joint("j", "a", "b", inside=LIMIT + '<axis xyz="0 0 0"/>')), "expected a direction"),
        (urdf(*TWO, joint("j", "a", "b", inside=LIMIT + '<axis xyz="0 0"/>')), "expected three finite numbers"),
        (urdf(link("a"), link("b", mass=-1), joint("j", "a", "b")), "link b: found the mass -1 kg"),
        (urdf(link("a"), link("b").replace("0.25", "nan"), joint("j", "a", "b")), "link b: found izz='nan'"),
        (urdf(link("a"), link("b").replace('ixx="0.2"', ""), joint("j", "a", "b")), "<inertia> lacks ixx"),
        (urdf(link("a"), link("b").replace('<mass value="1.5"/>', ""), joint("j", "a", "b")), "<mass> is missing"),
    ],
)
def test_bad_files_end_in_an_error_that_names_the_fault(tmp_path: Path, text: str, words: str) -> None:
    assert words in refusal(tmp_path, text)


def test_all_faults_of_a_file_are_reported(tmp_path: Path) -> None:
    message = refusal(tmp_path, urdf(link("a", -1), link("b", -2), joint("j", "a", "b", inside=Z)))
    assert len(message.splitlines()) == 3


def test_missing_file_folder_and_oversized_file(tmp_path: Path) -> None:
    for path in (tmp_path / "none.urdf", tmp_path):
        with pytest.raises(InputFileError):
            read_urdf(path)
    big = tmp_path / "big.urdf"
    big.write_bytes(b" " * (17 * 2**20))
    with pytest.raises(InputFileError, match="at most 16 MiB"):
        read_urdf(big)


def test_a_robot_name_with_a_path_or_markup_becomes_a_file_name(tmp_path: Path) -> None:
    text = urdf(link("base"), joint("j1", "base", "tip"), link("tip"))
    for given, expected in (("../../x", "x"), ("my robot", "my_robot"), ("a&lt;b&gt;", "a_b_"), ("///", "robot")):
        assert read(tmp_path, re.sub(r'<robot name="[^"]*"', f'<robot name="{given}"', text)).name == expected


def test_joint_names_that_tables_cannot_hold_are_refused(tmp_path: Path) -> None:
    message = refusal(tmp_path, urdf(link("base"), joint("a, =1+1", "base", "tip"), link("tip")))
    assert "rename the joint" in message
    assert "=1+1" in message
