"""Modules with identified friction: copies of an assembly's module documents, and the assembly that uses them."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.io.catalogue import read_assembly
from modrob_cli.io.documents import kind_of
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.yaml_loader import YamlDocument, load_yaml
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.joint import Joint
from modrob_cli.model.module import ModuleUse
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.schema.from_model import scalar_data
from modrob_cli.workflows.robots import URDF_SUFFIXES, LoadedRobot

Data = dict[str, Any]


def write_overlay(loaded: LoadedRobot, robot: Robot, folder: OutputFolder, modules: str, assembly: str) -> Data | None:
    """Write the modules of the assembly that a robot came from, with the friction and rotors of ``robot``.

    A module that is used several times gets the hull of what was found for its uses.

    Parameters
    ----------
    modules, assembly : names of the folder and of the file

    Returns
    -------
    overlay : what was joined, as plain data; None if the robot does not come from an assembly
    """
    source = _assembly_document(loaded.files[0])
    if source is None:
        return None
    chain = read_assembly(loaded.files[0], loaded=source).assembly.modules
    documents = {found.data["name"]: found.data for found in map(load_yaml, loaded.files[1:])}
    uses: dict[tuple[str, int], list[Joint]] = {}
    for (name, k), joint in zip(_units(chain), robot.joints, strict=True):
        uses.setdefault((name, k), []).append(joint)
    for name, data in documents.items():
        for k, unit in enumerate(data.get("units", [])):
            unit["joint"] = {**unit["joint"], **_drive_data(uses[name, k])}
        folder.write(f"{modules}/{name}.yaml", yaml_text(data))
    ends = zip(robot.disturbance.inf, robot.disturbance.sup, strict=True)
    disturbance = [[float(low), float(high)] for low, high in ends]
    folder.write(assembly, yaml_text({**source.data, "catalogue": [modules], "disturbance": disturbance}))
    joined = [
        {"module": name, "unit": k + 1, "joints": [joint.name for joint in joints]}
        for (name, k), joints in uses.items()
        if len(joints) > 1
    ]
    return {"modules": sorted(documents), "joined": joined}


def _assembly_document(path: Path) -> YamlDocument | None:
    if path.suffix.lower() in URDF_SUFFIXES:
        return None
    loaded = load_yaml(path)
    return loaded if kind_of(loaded) == "assembly/1" else None


def _units(chain: tuple[ModuleUse, ...]) -> Iterator[tuple[str, int]]:
    """Module and number of its unit, from 0, of every joint of the chain."""
    for use in chain:
        for k in range(len(use.module.units)):
            yield use.module.name, k


def _drive_data(joints: list[Joint]) -> Data:
    """Keys of a joint in a module document: friction and rotor that hold those of all these joints."""
    friction = [joint.friction for joint in joints]
    return {
        "friction": {
            "viscous": _hull([part.viscous for part in friction]),
            "coulomb": _hull([part.coulomb for part in friction]),
            "coulomb_band": max(part.coulomb_band for part in friction),
            "velocity_band": max(part.velocity_band for part in friction),
        },
        "rotor_inertia": _hull([joint.drive.rotor_inertia for joint in joints]),
    }


def _hull(values: list[Uncertain]) -> float | Data:
    interval = values[0].interval
    for value in values[1:]:
        interval = interval.hull(value.interval)
    middle = float(np.mean([value.nominal for value in values]))
    return scalar_data(float(np.clip(middle, interval.inf, interval.sup)), interval)
