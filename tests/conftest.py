"""Fixtures that many tests share: the command, and a small workspace of good documents."""

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings
from typer.testing import CliRunner, Result

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

MODULES = {
    "B": "modrob: module/1\nname: B\nkind: base\nconnections:\n  out: {n: 0.1}\n",
    "J": """\
modrob: module/1
name: J
kind: joint
units:
- proximal: {p: -0.1}
  joint:
    type: revolute
    friction: {viscous: 2.5, coulomb: {nominal: 1.5, tol: 10%}}
    gear_ratio: 100
    torque_constant: 0.05
    limits: {position: [-170 deg, 170 deg], velocity: 2, torque: 40, current: 10}
  distal:
    alpha: -pi/2
    n: 0.1
    body:
      mass: 2
      com: [0, 0.01, 0.02]
      inertia: {xx: 0.01, yy: 0.01, zz: 0.008}
""",
    "L": """\
modrob: module/1
name: L
kind: link
connections:
  out: {a: 0.3}
  side: {pose: {xyz: [0.1, 0, 0], rpy: [0, 90 deg, 0]}}
body:
  mass: 1.5
  com: [0.15, 0, 0]
  inertia: {xx: 0.002, yy: 0.012, zz: 0.012}
""",
    "E": """\
modrob: module/1
name: E
kind: end-effector
connections:
  tip: {p: -0.08}
body: {mass: 1.0, com: [0, 0, 0.04], inertia: {xx: 0.001, yy: 0.001, zz: 0.0005}}
""",
}

ASSEMBLY = """\
modrob: assembly/1
name: arm
catalogue: parts
modules: [B, J, {module: L, output: out}, J, E]
payload: {mass: {nominal: 1, min: 0, max: 2}, com: [0, 0, 0.05], inertia: {xx: 0.001, yy: 0.001, zz: 0.001}}
"""

ROBOT = """\
modrob: robot/1
name: planar
joints:
- {name: j1, type: revolute, dh: {a: 0.5}}
- {name: j2, type: revolute, dh: {a: 0.4}}
bodies:
- {link: 1, mass: 3, com: [-0.25, 0, 0], inertia: {xx: 0.01, yy: 0.06, zz: 0.06}}
- {link: 2, mass: 2, com: [-0.2, 0, 0], inertia: {xx: 0.01, yy: 0.03, zz: 0.03}}
"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A folder with ``parts/*.yaml``, ``arm.yaml`` and ``planar.yaml``, all of them good."""
    parts = tmp_path / "parts"
    parts.mkdir()
    for name, text in MODULES.items():
        (parts / f"{name}.yaml").write_text(text)
    (tmp_path / "arm.yaml").write_text(ASSEMBLY)
    (tmp_path / "planar.yaml").write_text(ROBOT)
    return tmp_path


@pytest.fixture
def modrob() -> Callable[..., Result]:
    """Run the command in this process: ``modrob("check", path)``."""
    from modrob_cli.cli.app import app

    def run(*arguments: object) -> Result:
        return CliRunner().invoke(app, [str(argument) for argument in arguments])

    return run
