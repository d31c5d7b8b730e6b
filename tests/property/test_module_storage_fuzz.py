import contextlib
import struct
import tempfile
import zlib
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from modrob_cli.errors import InputFileError, UsageError
from modrob_cli.interval import Interval
from modrob_cli.io.documents import check_document
from modrob_cli.io.module_storage import read_storage
from modrob_cli.io.module_storage_extended import MAGIC, encode_extended
from modrob_cli.io.module_storage_plain import encode_plain
from modrob_cli.io.module_storage_record import StoredModule, StoredUnit
from modrob_cli.io.module_storage_yaml import module_text
from modrob_cli.io.yaml_loader import parse_yaml
from modrob_cli.model.body import RigidBody
from modrob_cli.model.joint import Drive, Friction, Limits
from modrob_cli.model.module import Actuation, ConnectionData
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.schema import ModuleDocument
from modrob_cli.workflows.pack import stored_module

FILE = Path("module.bin")
NUMBERS = st.floats(-1e6, 1e6)
POSITIVE = st.floats(0.0, 1e6)
TRICKY = st.sampled_from(
    ["1e3", "012", "1", "no", "null", "True", "1E-5"]
)  # text that YAML may take for something else
NAMES = st.one_of(TRICKY, st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_+-]{0,20}", fullmatch=True))
# control characters and line separators cannot be in a document
TEXTS = st.one_of(TRICKY, st.text(st.characters(codec="utf-8", exclude_categories=["C", "Zl", "Zp"]), max_size=40))


@st.composite
def quantities(draw: st.DrawFn, count: int | None, positive: tuple[int, ...] = ()) -> Uncertain:
    """One uncertain number (count None) or several; those at the ``positive`` places are not negative."""
    rows = [
        sorted(draw(st.lists(POSITIVE if k in positive else NUMBERS, min_size=3, max_size=3)))
        if draw(st.booleans())
        else [draw(POSITIVE if k in positive else NUMBERS)] * 3
        for k in range(count or 1)
    ]
    low, nominal, high = np.array(rows).T if count else np.array(rows[0])
    return Uncertain(np.asarray(nominal), Interval(low, high))


@st.composite
def bodies(draw: st.DrawFn) -> RigidBody:
    mass, com = draw(quantities(None, (0,))), draw(quantities(3))
    return RigidBody("", mass, com, draw(quantities(6, (0, 3, 5))), draw(st.sampled_from(["com", "frame"])))


def parts(delta: str) -> st.SearchStrategy[ConnectionData]:
    return st.builds(ConnectionData, NUMBERS, NUMBERS, NUMBERS, NUMBERS, **{delta: NUMBERS})


RANGES = st.one_of(st.none(), st.tuples(NUMBERS, NUMBERS).map(lambda pair: (min(pair), max(pair))))
LIMITS = st.builds(Limits, RANGES, RANGES, RANGES, RANGES, RANGES, RANGES)
OPTIONAL = st.one_of(st.none(), st.floats(1e-9, 1e6))
FRICTION = st.builds(Friction, quantities(None, (0,)), quantities(None, (0,)), POSITIVE, POSITIVE)
DRIVES = st.builds(Drive, quantities(None, (0,)), NUMBERS, OPTIONAL, OPTIONAL)
JOINTS = st.builds(Actuation, st.sampled_from(["revolute", "prismatic"]), NUMBERS, FRICTION, DRIVES, LIMITS)
UNITS = st.builds(StoredUnit, parts("delta_in"), bodies(), JOINTS, parts("delta_out"), bodies())
LINKS = st.builds(
    StoredModule,
    NAMES,
    st.sampled_from(["base", "link", "end-effector"]),
    TEXTS,
    TEXTS,
    st.dictionaries(NAMES, st.builds(ConnectionData, *[NUMBERS] * 6), min_size=1, max_size=3),
    bodies(),
)
ARMS = st.builds(
    StoredModule, NAMES, st.just("joint"), TEXTS, TEXTS, units=st.lists(UNITS, min_size=1, max_size=2).map(tuple)
)
MODULES = st.one_of(LINKS, ARMS)


def read(raw: bytes, name: str | None, kind: str | None = None) -> StoredModule:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "module.bin"
        path.write_bytes(raw)
        return read_storage(path, kind, name)  # type: ignore[arg-type]


def uncertain_of(module: StoredModule) -> list[Uncertain]:
    found = [module.body] if module.body else []
    out = []
    for unit in module.units:
        found += [unit.proximal_body, unit.distal_body]
        out += [unit.joint.friction.viscous, unit.joint.friction.coulomb, unit.joint.drive.rotor_inertia]
    return out + [value for body in found for value in (body.mass, body.com, body.inertia)]


@settings(max_examples=150, deadline=None)
@given(MODULES)
def test_extended_round_trip_encloses_the_original(module: StoredModule) -> None:
    back = read(encode_extended(module, "file"), None)
    for value, original in zip(uncertain_of(back), uncertain_of(module), strict=True):
        assert np.all(value.interval.encloses(original.interval))
        assert np.all(np.float32(value.nominal) == np.float32(original.nominal))
    assert back.outputs == module.outputs
    for unit, was in zip(back.units, module.units, strict=True):
        assert (unit.proximal, unit.distal) == (was.proximal, was.distal)
        assert unit.joint.limits == was.joint.limits
        assert unit.joint.offset == was.joint.offset
        assert unit.joint.drive.gear_ratio == was.joint.drive.gear_ratio
        assert unit.joint.friction.velocity_band == was.joint.friction.velocity_band


@settings(max_examples=150, deadline=None)
@given(MODULES)
def test_extended_through_a_document_changes_no_byte(module: StoredModule) -> None:
    raw = encode_extended(module, "file")
    text = module_text(read(raw, None), FILE)
    document = check_document(parse_yaml(text, "module.yaml"), ModuleDocument)
    assert isinstance(document, ModuleDocument)
    assert encode_extended(stored_module(document), "file") == raw


@settings(max_examples=150, deadline=None)
@given(MODULES)
def test_plain_through_a_document_changes_no_byte(module: StoredModule) -> None:
    raw = encode_plain(module, "file")
    text = module_text(read(raw, module.name, module.kind), FILE)
    document = check_document(parse_yaml(text, "module.yaml"), ModuleDocument)
    assert isinstance(document, ModuleDocument)
    assert encode_plain(stored_module(document), "file") == raw


def survives(raw: bytes, name: str | None) -> None:
    """Whatever the bytes: a module with a valid document, or an error in words."""
    with contextlib.suppress(InputFileError, UsageError):
        module_text(read(raw, name), FILE)


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=400))
def test_any_bytes(raw: bytes) -> None:
    survives(raw, "X")
    survives(raw[: len(raw) // 64 * 64], "X")


@settings(max_examples=300, deadline=None)
@given(MODULES, st.lists(st.tuples(st.integers(12, 2000), st.integers(0, 255)), min_size=1, max_size=6))
def test_nonsense_under_a_good_checksum(module: StoredModule, changes: list[tuple[int, int]]) -> None:
    raw = bytearray(encode_extended(module, "file")[:-4])
    for at, value in changes:
        raw[at % len(raw)] = value
    raw[:8], raw[8:10] = MAGIC, b"\x01\0"
    raw[12:16] = struct.pack("<I", len(raw) + 4)
    survives(bytes(raw) + struct.pack("<I", zlib.crc32(raw)), None)
