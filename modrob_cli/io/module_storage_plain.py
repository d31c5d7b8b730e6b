"""Plain on-module storage: little-endian single-precision numbers and nothing else. [D] 2.4.1."""

import math
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.module_storage_record import JOINT_TYPES, StoredModule, StoredUnit
from modrob_cli.io.single_precision import restore_angle, shortest_decimal
from modrob_cli.model.body import INERTIA_ENTRIES, RigidBody, tensor_entries
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.module import Actuation, ConnectionData, ModuleKind
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.spatial import parallel_axis

_PART = ("a", "alpha", "p", "n", "delta")
_BODY = ("mass", "com.x", "com.y", "com.z", *(f"inertia.{entry}" for entry in INERTIA_ENTRIES))

UNIT_LAYOUT = (
    *(f"proximal.{key}" for key in _PART),
    *(f"distal.{key}" for key in _PART),
    "joint.delta",
    "joint.type",
    *(f"proximal.{key}" for key in _BODY),
    *(f"distal.{key}" for key in _BODY),
    *(f"joint.{key}" for key in ("viscous", "coulomb", "torque_constant", "rotor_inertia", "gear_ratio")),
)
"""Order of the 37 numbers of a simple joint unit."""

LINK_LAYOUT = ("a", "alpha", "p", "n", "delta_in", "delta_out", *_BODY)
"""Order of the 16 numbers of a pair of connectors of a link-like module."""

UNIT_BYTES = 4 * len(UNIT_LAYOUT)
LINK_BYTES = 4 * len(LINK_LAYOUT)

Values = dict[str, float]


def encode_plain(module: StoredModule, file: str) -> bytes:
    """Nominal parameters of a module: 148 bytes per joint unit, or 64 per output connector in their order.

    Tensors are about the origin of the connector frame. Everything else that a module may hold is left out.

    Raises
    ------
    InputFileError
        If a number is too large for single precision; ``file`` is the document to blame.
    """
    if module.kind == "joint":
        records = [(UNIT_LAYOUT, _unit_values(unit)) for unit in module.units]
    else:
        body = {} if module.body is None else _body_values(module.body)
        records = [(LINK_LAYOUT, {**_link_values(data), **body}) for data in module.outputs.values()]
    values = [values.get(key, 0.0) for layout, values in records for key in layout]
    with np.errstate(over="ignore"):
        packed = np.array(values, dtype="<f4") + np.float32(0.0)  # no negative zeros
    if not np.all(np.isfinite(packed)):
        worst = values[int(np.argmin(np.isfinite(packed)))]
        raise InputFileError(Fault(file, f"found {worst:.6g}, expected numbers up to 3.4e38 (single precision)"))
    return packed.tobytes()


def decode_plain(raw: bytes, file: Path, kind: ModuleKind, name: str) -> StoredModule:
    """Module of a plain file; its kind and name are not in it.

    Raises
    ------
    InputFileError
        If the size does not fit the kind, or a number cannot be what its place says.
    """
    layout = UNIT_LAYOUT if kind == "joint" else LINK_LAYOUT
    size = 4 * len(layout)
    if not raw or len(raw) % size:
        unit = "joint unit" if kind == "joint" else "output connector"
        message = f"found {len(raw)} bytes, expected a multiple of {size} ({size} per {unit} of a {kind} module)"
        raise InputFileError(Fault(str(file), f"{message}; is the file complete, and the kind right?"))
    numbers = np.frombuffer(raw, dtype="<f4").reshape(-1, len(layout))
    _check_numbers(numbers, layout, file)
    records = [dict(zip(layout, (float(x) for x in row), strict=True)) for row in numbers]
    source = "plain on-module storage"
    if kind == "joint":
        return StoredModule(name, kind, source, units=tuple(_unit(values) for values in records))
    bodies = numbers[:, -len(_BODY) :]
    if not np.all(bodies == bodies[0]):
        message = "found different bodies for different outputs, expected the same body repeated; the file is corrupt"
        raise InputFileError(Fault(str(file), message))
    names = ["out"] if len(records) == 1 else [f"out{k}" for k in range(1, len(records) + 1)]
    outputs = {key: _link(values) for key, values in zip(names, records, strict=True)}
    return StoredModule(name, kind, source, outputs=outputs, body=_body(records[0], ""))


def _check_numbers(numbers: Array, layout: tuple[str, ...], file: Path) -> None:
    faults = []
    for row, column in np.argwhere(~np.isfinite(numbers)):
        at = 4 * (int(row) * len(layout) + int(column))
        message = f"found {numbers[row, column]} at byte {at}, expected a finite number; the file is corrupt"
        faults.append(Fault(str(file), message, f"[{row}].{layout[column]}"))
    if "joint.type" in layout:
        column = layout.index("joint.type")
        for row, value in enumerate(numbers[:, column]):
            if math.isfinite(value) and value not in range(len(JOINT_TYPES)):
                at = 4 * (row * len(layout) + column)
                message = f"found {value} at byte {at}, expected 0 (revolute) or 1 (prismatic); the file is corrupt"
                faults.append(Fault(str(file), message, f"[{row}].joint.type"))
    if faults:
        raise InputFileError(faults)


def _part_values(data: ConnectionData, delta: float) -> Values:
    return {"a": data.a, "alpha": data.alpha, "p": data.p, "n": data.n, "delta": delta}


def _link_values(data: ConnectionData) -> Values:
    return {**_part_values(data, 0.0), "delta_in": data.delta_in, "delta_out": data.delta_out}


def _body_values(body: RigidBody) -> Values:
    """Nominal parameters, the tensor about the origin of the frame. [D] (2.19)."""
    inertia = body.inertia.nominal
    if body.inertia_about == "com":
        inertia = inertia + body.mass.nominal * tensor_entries(parallel_axis(body.com.nominal))
    numbers = [body.mass.nominal, *body.com.nominal, *inertia]
    return dict(zip(_BODY, (float(x) for x in numbers), strict=True))


def _unit_values(unit: StoredUnit) -> Values:
    joint, drive = unit.joint, unit.joint.drive
    parts = {
        "proximal": {**_part_values(unit.proximal, unit.proximal.delta_in), **_body_values(unit.proximal_body)},
        "distal": {**_part_values(unit.distal, unit.distal.delta_out), **_body_values(unit.distal_body)},
        "joint": {
            "delta": joint.offset,
            "type": float(JOINT_TYPES.index(joint.type)),
            "viscous": float(joint.friction.viscous.nominal),
            "coulomb": float(joint.friction.coulomb.nominal),
            "torque_constant": drive.torque_constant or 0.0,
            "rotor_inertia": float(drive.rotor_inertia.nominal),
            "gear_ratio": drive.gear_ratio,
        },
    }
    return {f"{part}.{key}": value for part, values in parts.items() for key, value in values.items()}


def _exact(values: Values, *keys: str) -> Uncertain:
    numbers = [shortest_decimal(values[key]) for key in keys]
    return Uncertain.exact(numbers[0] if len(numbers) == 1 else numbers)


def _body(values: Values, prefix: str) -> RigidBody:
    keys = [prefix + key for key in _BODY]
    return RigidBody("", _exact(values, keys[0]), _exact(values, *keys[1:4]), _exact(values, *keys[4:]), "frame")


def _link(values: Values, prefix: str = "", first: str = "delta_in", last: str = "delta_out") -> ConnectionData:
    a, p, n = (shortest_decimal(values[prefix + key]) for key in ("a", "p", "n"))
    turns = [restore_angle(values[prefix + key]) if key else 0.0 for key in (first, last)]
    return ConnectionData(a, restore_angle(values[prefix + "alpha"]), p, n, *turns)


def _unit(values: Values) -> StoredUnit:
    friction = Friction(_exact(values, "joint.viscous"), _exact(values, "joint.coulomb"))
    constant = shortest_decimal(values["joint.torque_constant"])
    gear_ratio = shortest_decimal(values["joint.gear_ratio"])
    drive = Drive(_exact(values, "joint.rotor_inertia"), gear_ratio, constant if constant != 0.0 else None)
    kind = JOINT_TYPES[int(values["joint.type"])]
    return StoredUnit(
        proximal=_link(values, "proximal.", first="delta", last=""),
        proximal_body=_body(values, "proximal."),
        joint=Actuation(kind, restore_angle(values["joint.delta"]), friction, drive),
        distal=_link(values, "distal.", first="", last="delta"),
        distal_body=_body(values, "distal."),
    )
