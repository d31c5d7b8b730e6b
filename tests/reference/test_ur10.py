"""The whole slice on recordings of real robots."""

from pathlib import Path
from typing import Any

import pytest

from modrob_cli.workflows.validate import ValidateOptions, validate
from tests.shared_data import shared


def run(model: Path, log: Path, out: Path) -> dict[str, dict[str, Any]]:
    result = validate(model, [log], ValidateOptions("torque"), out)
    return {joint["name"]: joint for joint in result["logs"][0]["joints"]}


def test_ur10_torques_are_explained(tmp_path: Path) -> None:
    joints = run(shared("ur10/model.urdf"), shared("ur10/ur10_exciting_trajectory.mcap"), tmp_path)
    # An independent fit of the same terms reached .12 .05 .09 .26 .10 .26 in sample on the first 60 % of the log and
    # .15 .14 .11 .27 .11 .34 on the rest: the whole log lies between them.
    limits = (0.15, 0.10, 0.10, 0.27, 0.12, 0.34)
    for joint, limit in zip(joints.values(), limits, strict=True):
        assert joint["nrmse"] <= limit, joint["name"]


def test_tx40_friction_equals_the_published_one(tmp_path: Path) -> None:
    joints = list(run(shared("staubli_tx40/model.urdf"), shared("staubli_tx40/ident.mcap"), tmp_path).values())
    # Published with the recording; 5 % because each identification filters in its own way.
    for joint, viscous, coulomb in zip(joints, (8.05, 5.53, 1.97, 1.11), (7.14, 8.26, 6.34, 2.48), strict=False):
        assert joint["fit"]["viscous"] == pytest.approx(viscous, rel=0.05)
        assert joint["fit"]["coulomb"] == pytest.approx(coulomb, rel=0.05)
        assert joint["nrmse_low_passed"] < 0.1
    # The wrist is coupled, which terms per joint cannot explain.
    assert joints[4]["nrmse"] > 0.3
    assert joints[5]["nrmse"] > 0.3
