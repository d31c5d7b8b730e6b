"""Scenario documents with any value in any place: a scenario, or faults in words."""

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.documents import check_document
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.io.yaml_loader import YamlDocument, load_yaml
from modrob_cli.model.robot import Robot
from modrob_cli.schema import Document, ScenarioDocument
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.scenarios import controller_faults

ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=6),
    st.sampled_from(["tool", "PB1.1", "1 deg", "id", "a.py", "a.py:b", "\0.py"]),
    st.sampled_from([[], {}, [0.0] * 6, [1.0] * 7, [[0.0] * 3] * 3]),
    st.dictionaries(st.sampled_from(["mass", "xx", "nominal", "min", "tol", "noise", "L1"]), st.floats(), max_size=3),
)


def places(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all values inside."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, below in items:
        yield (*path, key)
        yield from places(below, (*path, key))


def has(node: Any, step: str | int) -> bool:
    return isinstance(node, dict) and step in node or isinstance(node, list) and step in range(len(node))


DATA = load_yaml(shipped_folder("scenarios") / "everything.yaml").data
PLACES = sorted(places(DATA), key=str)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot(shipped_folder("assemblies") / "lwa4p-6-tol5.yaml").robot


@settings(max_examples=400, deadline=None)
@given(changes=st.lists(st.tuples(st.sampled_from(PLACES), ANYTHING), min_size=1, max_size=3))
def test_any_value_in_any_place(robot: Robot, changes: list[tuple[tuple[Any, ...], Any]]) -> None:
    data = copy.deepcopy(DATA)
    for path, value in changes:
        node = data
        for step in path[:-1]:
            node = node[step] if has(node, step) else None
        if has(node, path[-1]):  # a change before this one may have taken it away
            node[path[-1]] = value
    loaded = YamlDocument("f.yaml", data, {(): (1, 1)})
    faults: list[Fault] = []
    document: Document | None = None
    try:
        document = check_document(loaded, ScenarioDocument)
    except InputFileError as refusal:
        faults = list(refusal.faults)
    if document is None:
        assert faults
        return
    assert isinstance(document, ScenarioDocument)
    unfit = list(document.robot_faults(robot))
    assert all(message for _, message in unfit)
    assert all(fault.message for fault in controller_faults(Path("no-such-folder/f.yaml"), document, loaded))
    if not unfit:
        scenario = document.to_model(robot)
        assert all(np.isfinite(contact.force).all() for contact in scenario.contacts)
        assert all(0 <= contact.link <= robot.dof for contact in scenario.contacts)


def test_a_document_without_change_is_good(robot: Robot) -> None:
    """The mutations start from something that passes."""
    document = check_document(YamlDocument("f.yaml", DATA, {(): (1, 1)}), ScenarioDocument)
    assert isinstance(document, ScenarioDocument)
    assert not list(document.robot_faults(robot))
