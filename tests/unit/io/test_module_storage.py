"""Bytes are built and read here with struct and zlib, by the tables of docs/storage.md."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from modrob_cli.errors import InputFileError, UsageError
from modrob_cli.interval import Interval
from modrob_cli.io.module_storage import read_storage
from modrob_cli.io.module_storage_extended import encode_extended
from modrob_cli.io.module_storage_plain import LINK_LAYOUT, UNIT_LAYOUT, encode_plain
from modrob_cli.io.module_storage_record import StoredModule, StoredUnit
from modrob_cli.io.module_storage_yaml import module_text
from modrob_cli.model.body import RigidBody
from modrob_cli.model.joint import Drive, Friction, Limits
from modrob_cli.model.module import Actuation, ConnectionData
from modrob_cli.model.uncertain import Uncertain

EXACT = Uncertain.exact


def a_body(about_com: bool = False) -> RigidBody:
    com = EXACT([0.1, 0.2, 0.3])
    inertia = EXACT([0.5, 0.01, 0.02, 0.6, 0.03, 0.7])
    return RigidBody("", EXACT(2.0), com, inertia, "com" if about_com else "frame")


def a_unit() -> StoredUnit:
    friction = Friction(EXACT(15.68), EXACT(7.14), coulomb_band=0.5, velocity_band=0.01)
    drive = Drive(EXACT(5.23e-5), 160.0, 0.0429, 4650.0)
    limits = Limits(position=(-2.9, 2.8), current=(-11.0, 11.0))
    joint = Actuation("prismatic", 0.25, friction, drive, limits)
    proximal, distal = ConnectionData(1, 2, 3, 4, delta_in=5), ConnectionData(6, 7, 8, 9, delta_out=10)
    return StoredUnit(proximal, a_body(), joint, distal, a_body())


def a_joint(count: int = 1) -> StoredModule:
    return StoredModule("J1", "joint", "source", "text", units=(a_unit(),) * count)


def a_link() -> StoredModule:
    outputs = {"outA": ConnectionData(1, 2, 3, 4, 5, 6), "outB": ConnectionData(7, 8, 9, 10, 11, 12)}
    mass = Uncertain(np.asarray(2.0), Interval(1.9, 2.2))
    zero = EXACT(np.zeros(3))
    return StoredModule("L1", "link", "", "", outputs, RigidBody("", mass, zero, EXACT(np.zeros(6)), "com"))


def test_plain_joint_is_37_numbers_in_the_documented_order() -> None:
    raw = encode_plain(a_joint(), "file")
    body = [2.0, 0.1, 0.2, 0.3, 0.5, 0.01, 0.02, 0.6, 0.03, 0.7]
    expected = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 0.25, 1, *body, *body, 15.68, 7.14, 0.0429, 5.23e-5, 160]
    assert len(raw) == 148
    assert raw == struct.pack("<37f", *expected)


def test_plain_link_is_16_numbers_for_each_output() -> None:
    raw = encode_plain(a_link(), "file")
    body = [2.0] + [0.0] * 9
    assert raw == struct.pack("<32f", 1, 2, 3, 4, 5, 6, *body, 7, 8, 9, 10, 11, 12, *body)


def test_plain_form_moves_the_tensor_to_the_frame() -> None:
    module = StoredModule("L", "link", outputs={"out": ConnectionData()}, body=a_body(about_com=True))
    stored = struct.unpack("<16f", encode_plain(module, "file"))[10:]
    # Steiner by hand: m = 2, c = (0.1, 0.2, 0.3)
    by_hand = [0.5 + 2 * 0.13, 0.01 - 2 * 0.02, 0.02 - 2 * 0.03, 0.6 + 2 * 0.10, 0.03 - 2 * 0.06, 0.7 + 2 * 0.05]
    np.testing.assert_allclose(stored, by_hand, rtol=1e-6)  # single precision


def test_documented_order_is_the_order_in_code() -> None:
    text = Path(__file__).parents[3].joinpath("docs/storage.md").read_text(encoding="utf-8")
    plain = text.split("## Plain form")[1].split("## Extended form")[0]
    rows = [row.split("|")[2].strip().strip("`") for row in plain.splitlines() if row.startswith("| ")]
    listed = [row for row in rows if row in UNIT_LAYOUT or row in LINK_LAYOUT]
    assert listed == [*UNIT_LAYOUT, *LINK_LAYOUT]


def extended_link() -> bytes:
    """The file of a_link, field by field as documented."""
    content = b"\x02L1" + b"\0\0" + b"\0\0"
    assert float(np.float32(1.9)) < 1.9 < 2.2 < float(np.float32(2.2))  # the nearest lie outside
    quantities = struct.pack("<3f", 2.0, np.float32(1.9), np.float32(2.2))
    content += b"\x01" + quantities + struct.pack("<27f", *([0.0] * 27))
    content += b"\x04outA" + struct.pack("<6d", 1, 2, 3, 4, 5, 6)
    content += b"\x04outB" + struct.pack("<6d", 7, 8, 9, 10, 11, 12)
    pad = b"\0" if (18 + len(content) + 4) % 2 == 0 else b""
    head = b"MODROB\x1a\n" + struct.pack("<HBBI", 1, 1, 2, 16 + len(content) + len(pad) + 4)
    return head + content + pad


def test_extended_link_byte_by_byte() -> None:
    content = extended_link()
    assert encode_extended(a_link(), "file") == content + struct.pack("<I", zlib.crc32(content))


def test_extended_joint_byte_by_byte() -> None:
    raw = encode_extended(a_joint(), "file")
    body = b"\0" + b"".join(struct.pack("<f", x) * 3 for x in (2.0, 0.1, 0.2, 0.3, 0.5, 0.01, 0.02, 0.6, 0.03, 0.7))
    content = b"\x02J1" + b"\x06\0source" + b"\x04\0text" + struct.pack("<5d", 1, 2, 3, 4, 5) + body
    content += struct.pack("<Bd", 1, 0.25) + b"".join(struct.pack("<f", x) * 3 for x in (15.68, 7.14, 5.23e-5))
    content += struct.pack("<3d", 0.5, 0.01, 160)
    # present: position (bit 0), current (5), torque constant (6), stiffness (7)
    content += struct.pack("<B6d", 0b11100001, -2.9, 2.8, -11, 11, 0.0429, 4650)
    content += struct.pack("<5d", 6, 7, 8, 9, 10) + body
    assert raw[16 : 16 + len(content)] == content
    assert len(content) == 3 + 8 + 6 + 392 + 2 * 16 + 2 * 8  # sizes in docs/storage.md


@pytest.mark.parametrize("module", [a_joint(), a_joint(3), a_link()], ids=["joint", "units", "link"])
def test_extended_form_gives_everything_back(module: StoredModule, tmp_path: Path) -> None:
    path = tmp_path / "module.bin"
    path.write_bytes(encode_extended(module, "file"))
    back = read_storage(path, None, None)
    assert (back.name, back.kind, back.source, back.description) == (
        module.name,
        module.kind,
        module.source,
        module.description,
    )
    assert back.outputs == module.outputs
    for unit, original in zip(back.units, module.units, strict=True):
        assert (unit.proximal, unit.distal) == (original.proximal, original.distal)
        assert (unit.joint.type, unit.joint.offset) == (original.joint.type, original.joint.offset)
        assert unit.joint.limits == original.joint.limits
        assert unit.joint.drive.stiffness == 4650.0
        assert (unit.joint.friction.coulomb_band, unit.joint.friction.velocity_band) == (0.5, 0.01)
        assert unit.joint.friction.viscous.nominal == 15.68
    assert encode_extended(back, "file") == path.read_bytes()


def test_every_flipped_bit_is_found(tmp_path: Path) -> None:
    raw = encode_extended(a_link(), "file")
    path = tmp_path / "module.bin"
    for at in range(8 * len(raw)):
        damaged = bytearray(raw)
        damaged[at // 8] ^= 1 << at % 8
        path.write_bytes(damaged)
        with pytest.raises(InputFileError):
            read_storage(path, None, None)


@pytest.mark.parametrize("extended", [True, False])
def test_every_other_length_is_found(extended: bool, tmp_path: Path) -> None:
    raw = encode_extended(a_joint(), "file") if extended else encode_plain(a_joint(2), "file")
    path = tmp_path / "module.bin"
    for size in [*range(len(raw)), len(raw) + 1, len(raw) + 64]:
        path.write_bytes((raw + b"\0" * 64)[:size])
        if not extended and size in (148, 64, 128, 192, 256):
            continue  # a whole number of records: nothing in the plain form tells
        with pytest.raises(InputFileError):
            read_storage(path, None, None if extended else "J1")


def test_extended_length_is_odd() -> None:
    # so that no damage to its mark can make it pass for a plain file, whose lengths are even
    for name in ("J", "J1", "J12"):
        assert len(encode_extended(StoredModule(name, "joint", units=(a_unit(),)), "file")) % 2 == 1


@pytest.mark.parametrize(
    ("at", "value", "what"),
    [(30, float("nan"), "found nan at byte 120"), (2, float("inf"), "found inf at byte 8"), (11, 0.5, "revolute")],
)
def test_numbers_that_cannot_be(at: int, value: float, what: str, tmp_path: Path) -> None:
    numbers = list(struct.unpack("<37f", encode_plain(a_joint(), "file")))
    numbers[at] = value
    path = tmp_path / "module.bin"
    path.write_bytes(struct.pack("<37f", *numbers))
    with pytest.raises(InputFileError, match=what):
        read_storage(path, None, "J1")


def test_negative_mass_is_found(tmp_path: Path) -> None:
    numbers = list(struct.unpack("<37f", encode_plain(a_joint(), "file")))
    numbers[12] = -1.0
    path = tmp_path / "module.bin"
    path.write_bytes(struct.pack("<37f", *numbers))
    with pytest.raises(InputFileError, match=r"units\[0\].proximal.body.mass"):
        module_text(read_storage(path, None, "J1"), path)


def test_outputs_with_different_bodies_are_found(tmp_path: Path) -> None:
    path = tmp_path / "module.bin"
    path.write_bytes(encode_plain(a_link(), "file")[:-4] + struct.pack("<f", 1.0))
    with pytest.raises(InputFileError, match="different bodies"):
        read_storage(path, None, "L1")


def test_ambiguous_size_needs_the_kind(tmp_path: Path) -> None:
    # 2368 = 16 x 148 = 37 x 64
    path = tmp_path / "module.bin"
    path.write_bytes(encode_plain(a_joint(16), "file"))
    with pytest.raises(UsageError, match="--kind joint or --kind link"):
        read_storage(path, None, "J1")
    assert len(read_storage(path, "joint", "J1").units) == 16


def test_later_version_is_told_apart(tmp_path: Path) -> None:
    raw = bytearray(encode_extended(a_link(), "file"))
    raw[8] = 2
    path = tmp_path / "module.bin"
    path.write_bytes(raw)
    with pytest.raises(InputFileError, match="version 2"):
        read_storage(path, None, None)


@pytest.mark.parametrize("encode", [encode_plain, encode_extended])
def test_numbers_beyond_single_precision(encode: object) -> None:
    body = RigidBody("", EXACT(1e39), EXACT(np.zeros(3)), EXACT(np.zeros(6)))
    module = StoredModule("L", "link", outputs={"out": ConnectionData()}, body=body)
    assert callable(encode)
    with pytest.raises(InputFileError, match="single precision"):
        encode(module, "file")


def test_text_too_long_for_its_field() -> None:
    with pytest.raises(InputFileError, match="70000 bytes"):
        encode_extended(StoredModule("L", "link", "x" * 70_000, body=a_body()), "file")
