"""Every option that decides the result of a log is in the key of its task, or --resume would keep stale results."""

import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from modrob_cli.batch.jobs import LogTask
from modrob_cli.io.log_record import key_digest
from modrob_cli.workflows.collision_options import CollisionOptions, parse_filter
from modrob_cli.workflows.collision_task import CollisionTask
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_task import IdentifyTask
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_task import ValidateTask

ROBOT = load_robot(Path(__file__).parents[3] / "assemblies" / "lwa4p-6.yaml")
OF_ALL_LOGS = {"max_nrmse", "fit_per_log", "bounds", "rigid_body"}
"""Options of identify that concern the fit of all logs together, which is made anew each time."""
FILTERED = CollisionOptions("torque", filter=parse_filter("butterworth2:20"))


def digest(task: LogTask) -> str:
    key = task.key()
    return key_digest({"options": key.options, "inputs": key.inputs})


def others(name: str, value: Any) -> Any:
    """Another value of the same kind."""
    special = {"desired": Path("other.yaml"), "train": (Path("other.mcap"),), "kind": "first-order"}
    if name in special:
        return special[name]
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return math.nextafter(value, math.inf)
    if isinstance(value, str):
        return f"{value}x"
    if isinstance(value, tuple):
        return (*value, "x")
    return {**value, "a": "b"} if isinstance(value, dict) else 0.375


def kept(options: Any, make: Callable[[Any], LogTask], path: str = "") -> list[str]:
    """Options whose change does not change the key."""
    before, found = digest(make(options)), []
    for field in fields(options):
        value = getattr(options, field.name)

        def changed(new: Any, name: str = field.name) -> Any:
            return replace(options, **{name: new})

        if is_dataclass(value):
            found += kept(value, lambda new, changed=changed: make(changed(new)), f"{path}{field.name}.")  # type: ignore[misc]
        elif digest(make(changed(others(field.name, value)))) == before:
            found.append(path + field.name)
    return found


@pytest.mark.parametrize(
    ("options", "make", "expected"),
    [
        (ValidateOptions("torque"), lambda options: ValidateTask(ROBOT, options, {}), set()),
        (IdentifyOptions("torque"), lambda options: IdentifyTask(ROBOT, options, {}), OF_ALL_LOGS),
        (FILTERED, lambda options: CollisionTask(ROBOT, options, None, {}), set()),
    ],
    ids=["validate", "identify", "collision"],
)
def test_every_option_is_in_the_key(options: Any, make: Callable[[Any], LogTask], expected: set[str]) -> None:
    assert set(kept(options, make)) == expected


def test_a_change_of_the_robot_changes_the_key() -> None:
    one, other = (
        ValidateTask(ROBOT, ValidateOptions("torque"), {"arm.yaml": text}) for text in ("sha256:1", "sha256:2")
    )
    assert digest(one) != digest(other)
