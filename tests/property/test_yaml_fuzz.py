"""Mutated documents give a document or an InputFileError, nothing else (warnings are errors here)."""

import math
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from benchmarks.fuzz_loader import SEEDS, mutated, run
from modrob_cli.errors import InputFileError
from modrob_cli.io.documents import check_document
from modrob_cli.io.yaml_loader import YamlDocument, load_yaml, parse_yaml
from modrob_cli.io.yaml_scalars import plain_scalar
from modrob_cli.schema import Document, ModuleDocument
from modrob_cli.workflows.check import check

plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["pi/2", "5%", "J"]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                ["nominal", "min", "max", "tol", "mass", "com", "inertia", "xx", "pose", "xyz", "rpy", "a", "name"]
            )
            | st.text(max_size=5),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)


def outcome(text: str) -> Document | None:
    """The document, or None where an InputFileError says why there is none."""
    try:
        return check_document(parse_yaml(text, "f.yaml"))
    except InputFileError as refusal:
        faults = refusal.faults
    assert faults
    assert all(fault.file == "f.yaml" and fault.message for fault in faults)
    return None


def checked(data: Any) -> Document | None:
    """The document from data, or None where an InputFileError lists faults."""
    try:
        return check_document(YamlDocument("f.yaml", data, {(): (1, 1)}))
    except InputFileError as refusal:
        faults = refusal.faults
    assert faults
    return None


@settings(max_examples=300, deadline=None)
@given(text=st.text(max_size=200))
@example("\ufeff")
@example("? [")
@example("%YAML 1.2\n---\n")
def test_any_text(text: str) -> None:
    assert outcome(text) is None


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(raw=st.binary(max_size=200))
def test_any_bytes(tmp_path: Path, raw: bytes) -> None:
    path = tmp_path / "x.yaml"
    path.write_bytes(raw)
    result = check([path])
    assert len(result.files) == 1
    assert result.faults


@settings(max_examples=400, deadline=None)
@given(
    seed=st.sampled_from(["module/1", "assembly/1", "robot/1"]),
    values=st.dictionaries(
        st.sampled_from(
            ["name", "kind", "connections", "body", "units", "joints", "bodies", "payload", "modules", "catalogue",
             "gravity", "base_pose", "tool_transform", "disturbance", "limits", "joint_names", "source"]
        ),
        plain,
    ),
)  # fmt: skip
def test_any_data(seed: str, values: dict[str, Any]) -> None:
    checked({"modrob": seed, **values})


@settings(max_examples=200, deadline=None)
@given(value=plain)
def test_any_body(value: Any) -> None:
    data = {"modrob": "module/1", "name": "x", "kind": "link", "connections": {"out": {}}, "body": value}
    document = checked(data)
    assert document is None or isinstance(document, ModuleDocument)
    if document is not None:
        document.to_model()


@pytest.mark.parametrize("seed", range(4))
def test_mutated_documents(tmp_path: Path, seed: int) -> None:
    outcomes = run(250, seed, tmp_path)
    assert not [name for name in outcomes if name.startswith("FINDING")], outcomes
    assert sum(outcomes.values()) == 250


def test_the_fuzzer_reaches_beyond_the_schema(tmp_path: Path) -> None:
    assert outcome(SEEDS[3]) is not None
    outcomes = run(400, 99, tmp_path)
    assert outcomes["clean"] + outcomes["warnings"] >= 20, outcomes


def test_the_fuzzer_repeats() -> None:
    assert mutated(SEEDS[0], random.Random(5)) == mutated(SEEDS[0], random.Random(5))


@settings(max_examples=500, deadline=None)
@given(value=st.floats() | st.integers(-(2**53), 2**53) | st.just(2**90))
def test_numbers_are_read_back_exactly(value: float) -> None:
    text = repr(value) if math.isfinite(value) else {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}[repr(value)]
    found = plain_scalar(text)
    assert isinstance(found, int | float)
    assert found == value or (math.isnan(value) and math.isnan(found))
    assert isinstance(found, type(value)) or len(text) > 18  # longer integers are read as floats


@pytest.mark.parametrize(
    ("text", "value"),
    [("no", "no"), ("on", "on"), ("012", 12), ("1_000", "1_000"), ("0x1F", "0x1F"), ("1:30", "1:30"), ("1e3", 1000.0),
     ("1.e3", 1000.0), (".5", 0.5), (".", "."), ("+5", 5), ("2024-01-01", "2024-01-01"), ("TRUE", True),
     ("tRUE", "tRUE"), ("~", None), ("", None), ("9" * 19, 1e19), ("\u0661", "\u0661"), ("nan", "nan"),
     ("inf", "inf"), ("1e", "1e")],
)  # fmt: skip
def test_plain_scalars(text: str, value: object) -> None:
    found = plain_scalar(text)
    assert type(found) is type(value)
    assert found == value


def test_places_of_values_through_aliases(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text("a: &x\n  b: 1\nc:\n- 5\n- *x\n")
    loaded = load_yaml(path)
    assert loaded.data == {"a": {"b": 1}, "c": [5, {"b": 1}]}
    places = [(loaded.fault(p, "m").line, loaded.fault(p, "m").column) for p in (("a", "b"), ("c", 0), ("c", 1, "b"))]
    assert places == [(2, 3), (4, 3), (5, 3)]
