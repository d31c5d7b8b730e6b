"""Extended on-module storage: the whole module, with bounds, limits, names and a checksum.

The layout, byte by byte, is in docs/storage.md. What no interval can absorb the rounding of (geometry, gear, limits,
bands) is stored in double precision; uncertain quantities in single precision with their bounds rounded outward.
"""

import struct
import zlib
from pathlib import Path

import numpy as np

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.interval import Interval
from modrob_cli.io.module_storage_bytes import ByteReader, ByteWriter
from modrob_cli.io.module_storage_record import JOINT_TYPES, KINDS, StoredModule, StoredUnit
from modrob_cli.io.single_precision import outward_triple, read_triple
from modrob_cli.model.body import INERTIA_ENTRIES, InertiaPoint, RigidBody
from modrob_cli.model.joint import Drive, Friction, Limits
from modrob_cli.model.module import Actuation, ConnectionData
from modrob_cli.model.uncertain import Uncertain

MAGIC = b"MODROB\x1a\n"
"""First bytes; a transfer as text would change the last two."""

VERSION = 1
_HEADER = struct.Struct("<8sHBBI")
_CHECKSUM_BYTES = 4
_POINTS: tuple[InertiaPoint, ...] = ("frame", "com")
_LIMITS = ("position", "velocity", "acceleration", "jerk", "torque", "current")


def encode_extended(module: StoredModule, file: str) -> bytes:
    """All of a module.

    Raises
    ------
    InputFileError
        If a number, a text or the count of outputs or units does not fit; ``file`` is the document to blame.
    """
    out = ByteWriter(file)
    count = len(module.units) or len(module.outputs)
    if count > 255:
        raise InputFileError(Fault(file, f"found {count} units or outputs, expected at most 255"))
    out.put_text(module.name, "B")
    out.put_text(module.source, "H")
    out.put_text(module.description, "H")
    for unit in module.units:
        _put_unit(out, unit)
    if module.body is not None:
        _put_body(out, module.body)
    for name, data in module.outputs.items():
        out.put_text(name, "B")
        out.put("6d", data.a, data.alpha, data.p, data.n, data.delta_in, data.delta_out)
    # An odd length is no multiple of 148 or 64: a damaged file is never taken for a plain one.
    padding = b"\0" * ((_HEADER.size + len(out.raw) + _CHECKSUM_BYTES) % 2 == 0)
    size = _HEADER.size + len(out.raw) + len(padding) + _CHECKSUM_BYTES
    head = _HEADER.pack(MAGIC, VERSION, KINDS.index(module.kind), count, size)
    content = head + bytes(out.raw) + padding
    return content + struct.pack("<I", zlib.crc32(content))


def decode_extended(raw: bytes, file: Path) -> StoredModule:
    """Module of an extended file.

    Raises
    ------
    InputFileError
        If it is truncated, too long, corrupt, or of another version.
    """
    count, reader = _check_frame(raw, file)
    kind = KINDS[raw[10]]
    name, source, description = reader.text("B", "name"), reader.text("H", "source"), reader.text("H", "description")
    units: tuple[StoredUnit, ...] = ()
    body, outputs = None, {}
    if kind == "joint":
        units = tuple(_get_unit(reader, f"units[{k}]") for k in range(count))
    else:
        body = _get_body(reader, "body")
        outputs = dict(_get_output(reader, f"outputs[{k}]") for k in range(count))
        if len(outputs) != count:
            raise reader.fault("outputs", "found an output name twice, expected different names")
    rest = reader.raw[reader.offset :]
    if rest not in (b"", b"\0"):
        raise reader.fault("", f"found {len(rest)} bytes behind the module, expected none or one zero byte")
    return StoredModule(name, kind, source, description, outputs, body, units)


def _check_frame(raw: bytes, file: Path) -> tuple[int, ByteReader]:
    """Check header and checksum; returns the count of units or outputs and a reader of the content."""
    smallest = _HEADER.size + _CHECKSUM_BYTES
    if len(raw) < smallest:
        raise InputFileError(Fault(str(file), f"found {len(raw)} bytes, expected at least {smallest}; it is truncated"))
    _, version, kind, count, size = _HEADER.unpack_from(raw)
    if version != VERSION:
        message = (
            f"found version {version} of the extended form, expected {VERSION}; use a newer modrob, or pack it again"
        )
        raise InputFileError(Fault(str(file), message))
    if len(raw) != size:
        what = "truncated" if len(raw) < size else "too long"
        message = f"found {len(raw)} bytes, expected {size} as its header says; it is {what} or corrupt"
        raise InputFileError(Fault(str(file), message))
    checksum = struct.unpack_from("<I", raw, size - _CHECKSUM_BYTES)[0]
    actual = zlib.crc32(raw[:-_CHECKSUM_BYTES])
    if actual != checksum:
        message = f"found the checksum {actual:08x}, expected {checksum:08x} as the file says; it is corrupt"
        raise InputFileError(Fault(str(file), message))
    if kind >= len(KINDS) or count == 0:
        raise InputFileError(
            Fault(str(file), f"found kind {kind} and count {count}, expected a kind 0..3 and a count > 0")
        )
    return count, ByteReader(file, raw[:-_CHECKSUM_BYTES], _HEADER.size)


def _put_quantity(out: ByteWriter, value: Uncertain) -> None:
    for nominal, low, high in zip(
        np.ravel(value.nominal), np.ravel(value.interval.inf), np.ravel(value.interval.sup), strict=True
    ):
        with np.errstate(over="ignore", under="ignore"):
            triple = outward_triple(float(nominal), Interval(low, high))
        if not np.all(np.isfinite(triple)):
            message = f"found {float(nominal):.6g}, expected numbers up to 3.4e38 (single precision)"
            raise InputFileError(Fault(out.file, message))
        out.put("3f", *triple)


def _get_quantity(reader: ByteReader, count: int, what: str) -> Uncertain:
    parts = []
    for _ in range(count):
        nominal, low, high = reader.floats("3f", what)
        if not low <= nominal <= high:
            raise reader.fault(what, f"found {nominal:.6g} in [{low:.6g}, {high:.6g}], expected it inside")
        value, low, high = read_triple(nominal, low, high)
        parts.append(Uncertain(np.asarray(value), Interval(low, high)))
    return Uncertain.stack(parts)


def _get_scalar(reader: ByteReader, what: str) -> Uncertain:
    value = _get_quantity(reader, 1, what)
    return Uncertain(value.nominal[0], value.interval[0])


def _put_body(out: ByteWriter, body: RigidBody) -> None:
    out.put("B", _POINTS.index(body.inertia_about))
    for value in (body.mass, body.com, body.inertia):
        _put_quantity(out, value)


def _get_body(reader: ByteReader, what: str) -> RigidBody:
    point = _POINTS[reader.choice(_POINTS, f"{what}.inertia_about")]
    mass, com = _get_scalar(reader, f"{what}.mass"), _get_quantity(reader, 3, f"{what}.com")
    return RigidBody("", mass, com, _get_quantity(reader, len(INERTIA_ENTRIES), f"{what}.inertia"), point)


def _get_output(reader: ByteReader, what: str) -> tuple[str, ConnectionData]:
    name = reader.text("B", f"{what}.name")
    return name, ConnectionData(*reader.floats("6d", f"{what} ({ascii(name)[1:-1]})"))


def _put_unit(out: ByteWriter, unit: StoredUnit) -> None:
    first, last = unit.proximal, unit.distal
    out.put("5d", first.a, first.alpha, first.p, first.n, first.delta_in)
    _put_body(out, unit.proximal_body)
    _put_joint(out, unit.joint)
    out.put("5d", last.a, last.alpha, last.p, last.n, last.delta_out)
    _put_body(out, unit.distal_body)


def _get_unit(reader: ByteReader, what: str) -> StoredUnit:
    a, alpha, p, n, delta = reader.floats("5d", f"{what}.proximal")
    proximal = ConnectionData(a, alpha, p, n, delta_in=delta)
    proximal_body = _get_body(reader, f"{what}.proximal.body")
    joint = _get_joint(reader, f"{what}.joint")
    a, alpha, p, n, delta = reader.floats("5d", f"{what}.distal")
    distal = ConnectionData(a, alpha, p, n, delta_out=delta)
    return StoredUnit(proximal, proximal_body, joint, distal, _get_body(reader, f"{what}.distal.body"))


def _put_joint(out: ByteWriter, joint: Actuation) -> None:
    friction, drive = joint.friction, joint.drive
    out.put("Bd", JOINT_TYPES.index(joint.type), joint.offset)
    for value in (friction.viscous, friction.coulomb, drive.rotor_inertia):
        _put_quantity(out, value)
    out.put("3d", friction.coulomb_band, friction.velocity_band, drive.gear_ratio)
    optional = [getattr(joint.limits, name) for name in _LIMITS]
    optional += [None if value is None else (value,) for value in (drive.torque_constant, drive.stiffness)]
    out.put("B", sum(1 << k for k, value in enumerate(optional) if value is not None))
    for value in optional:
        if value is not None:
            out.put(f"{len(value)}d", *value)


def _get_joint(reader: ByteReader, what: str) -> Actuation:
    kind = JOINT_TYPES[reader.choice(JOINT_TYPES, f"{what}.type")]
    (offset,) = reader.floats("d", f"{what}.delta")
    viscous, coulomb, rotor = (_get_scalar(reader, f"{what}.{key}") for key in ("viscous", "coulomb", "rotor_inertia"))
    coulomb_band, velocity_band, gear_ratio = reader.floats("3d", f"{what}.gear_ratio")
    mask = reader.integer("B", f"{what}.limits")
    present = [bool(mask >> k & 1) for k in range(8)]
    ends = {
        name: tuple(reader.floats("2d", f"{what}.limits.{name}"))
        for name, there in zip(_LIMITS, present[:6], strict=True)
        if there
    }
    torque_constant = reader.floats("d", f"{what}.torque_constant")[0] if present[6] else None
    stiffness = reader.floats("d", f"{what}.stiffness")[0] if present[7] else None
    limits = Limits(**{name: (low, high) for name, (low, high) in ends.items()})
    friction = Friction(viscous, coulomb, coulomb_band, velocity_band)
    return Actuation(kind, offset, friction, Drive(rotor, gear_ratio, torque_constant, stiffness), limits)
