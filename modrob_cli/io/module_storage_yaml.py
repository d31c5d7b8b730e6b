"""Stored modules as ``module/1`` documents."""

import math
from pathlib import Path
from typing import Any

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.interval import Interval
from modrob_cli.io.documents import check_document
from modrob_cli.io.module_storage_record import StoredModule, StoredUnit
from modrob_cli.io.single_precision import twelfth_of_pi
from modrob_cli.io.yaml_loader import parse_yaml
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.body import RigidBody
from modrob_cli.model.module import Actuation, ConnectionData
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.schema import ModuleDocument
from modrob_cli.schema.from_model import body_data, scalar_data

Data = dict[str, Any]


def module_text(module: StoredModule, file: Path) -> str:
    """The module as YAML that was checked against the schema.

    Raises
    ------
    InputFileError
        If the parameters do not make a module (negative mass, limits out of order ...); ``file`` is where they were
        read.
    """
    text = yaml_text(module_data(module))
    try:
        check_document(parse_yaml(text, str(file)), ModuleDocument)
    except InputFileError as error:
        faults = [Fault(fault.file, f"{fault.message}; is the file corrupt?", fault.path) for fault in error.faults]
        raise InputFileError(faults) from error
    return text


def module_data(module: StoredModule) -> Data:
    """The module as plain mappings and lists."""
    data: Data = {"modrob": "module/1", "name": module.name, "kind": module.kind}
    data |= {key: text for key in ("source", "description") if (text := getattr(module, key))}
    if module.kind == "joint":
        data["units"] = [_unit_data(unit) for unit in module.units]
        return data
    data["connections"] = {
        name: {**_geometry(output), "delta_in": _angle(output.delta_in), "delta_out": _angle(output.delta_out)}
        for name, output in module.outputs.items()
    }
    return data | ({} if module.body is None else _body_entry(module.body))


def _angle(angle: float) -> float | str:
    """Text such as pi/2 where the angle is exactly what the text stands for."""
    steps = round(angle * 12 / math.pi)
    exact, text = twelfth_of_pi(steps)
    return text if angle == exact and steps != 0 else angle


def _geometry(data: ConnectionData) -> Data:
    return {"a": data.a, "alpha": _angle(data.alpha), "p": data.p, "n": data.n}


def _is_zero(value: Uncertain) -> bool:
    return not value.interval.mag.any()


def _body_entry(body: RigidBody) -> Data:
    """Nothing for a part without a body."""
    if all(_is_zero(value) for value in (body.mass, body.com, body.inertia)):
        return {}
    return {"body": body_data(body)}


def _unit_data(unit: StoredUnit) -> Data:
    proximal = {**_geometry(unit.proximal), "delta": _angle(unit.proximal.delta_in), **_body_entry(unit.proximal_body)}
    distal = {**_geometry(unit.distal), "delta": _angle(unit.distal.delta_out), **_body_entry(unit.distal_body)}
    return {"proximal": proximal, "joint": _joint_data(unit.joint), "distal": distal}


def _scalar(value: Uncertain) -> Any:
    return scalar_data(float(value.nominal), Interval.of(value.interval))


def _joint_data(joint: Actuation) -> Data:
    friction, drive = joint.friction, joint.drive
    forces: Data = {"viscous": _scalar(friction.viscous), "coulomb": _scalar(friction.coulomb)}
    forces |= {key: band for key in ("coulomb_band", "velocity_band") if (band := getattr(friction, key))}
    data: Data = {"type": joint.type, "delta": _angle(joint.offset), "friction": forces}
    data |= {"rotor_inertia": _scalar(drive.rotor_inertia), "gear_ratio": drive.gear_ratio}
    data |= {key: number for key in ("torque_constant", "stiffness") if (number := getattr(drive, key)) is not None}
    limits = {key: list(ends) for key, ends in vars(joint.limits).items() if ends is not None}
    return data | ({"limits": limits} if limits else {})
