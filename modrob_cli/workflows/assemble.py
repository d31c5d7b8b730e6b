"""``modrob assemble``: from assemblies to robot files, tables, URDF and pictures."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.link_parameters import link_parameters
from modrob_cli.assembly.link_paths import link_paths
from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.catalogue import Catalogue
from modrob_cli.io.outputs import OutputFolder, provenance, text_sha256
from modrob_cli.io.urdf_writer import urdf_text
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.robot import Robot
from modrob_cli.plot.arm_picture import arm_picture
from modrob_cli.plot.svg import svg_text
from modrob_cli.schema.from_model import robot_data
from modrob_cli.workflows.robot_tables import RobotTables
from modrob_cli.workflows.robots import LoadedRobot, load_robot

PictureFormat = Literal["svg", "png", "none"]


@dataclass(frozen=True)
class AssembledRobot:
    """One robot, its tables and the files written for it (kind -> path)."""

    tables: RobotTables
    files: dict[str, str]

    def to_json(self) -> dict[str, Any]:
        """The entry of ``robots`` in the JSON result."""
        return {**self.tables.to_json(), "files": self.files}


def assemble(
    paths: list[Path],
    out: Path,
    q: list[float] | None = None,
    picture: PictureFormat = "svg",
    overwrite: bool = False,
) -> list[AssembledRobot]:
    """Build every robot, then write all files of all of them, or none.

    Parameters
    ----------
    q : joint positions of the picture, one per joint; all zero if left out

    Raises
    ------
    InputFileError
        With the faults of all files.
    UsageError
        If q does not fit, or two robots share a name.
    OutputExistsError
        If a file is there and ``overwrite`` is false.
    """
    loaded = _load_all(paths)
    poses = [_pose(item.robot, q) for item in loaded]
    with OutputFolder(out, overwrite) as folder:
        folder.claim([name for item in loaded for name in _names(item.robot, picture).values()])
        return [_write(item, pose, folder, picture) for item, pose in zip(loaded, poses, strict=True)]


def _load_all(paths: list[Path]) -> list[LoadedRobot]:
    catalogue = Catalogue()
    loaded: dict[str, LoadedRobot] = {}
    faults: list[Fault] = []
    for path in dict.fromkeys(paths):
        try:
            item = load_robot(path, catalogue)
        except InputFileError as error:
            faults.extend(error.faults)
            continue
        first = loaded.setdefault(item.robot.name, item)
        if first is not item:
            message = f"the name {item.robot.name} is that of {first.files[0]} too; rename one of them"
            faults.append(Fault(str(path), message, "$.name"))
    if faults:
        raise InputFileError(dict.fromkeys(faults))
    return list(loaded.values())


def _pose(robot: Robot, q: list[float] | None) -> Array:
    if q is not None and len(q) != robot.dof:
        raise UsageError(f"--q has {len(q)} values, but {robot.name} has {robot.dof} joints")
    return np.zeros(robot.dof) if q is None else np.asarray(q)


def _names(robot: Robot, picture: PictureFormat) -> dict[str, str]:
    """File names by kind."""
    name = robot.name
    names = {kind: f"{name}.{kind}.csv" for kind in ("dh", "dynpar", "intervals")}
    names = {"robot": f"{name}.robot.yaml", **names, "urdf": f"{name}.urdf"}
    if picture != "none":
        names["picture"] = f"{name}.{picture}"
    return {**names, "manifest": f"{name}.manifest.json"}


def _write(item: LoadedRobot, q: Array, folder: OutputFolder, picture: PictureFormat) -> AssembledRobot:
    robot = item.robot
    tables = RobotTables.of(robot)
    names = _names(robot, picture)
    origin = provenance(item.files)
    in_link = link_parameters(robot, np.broadcast_to(np.eye(4), (robot.dof, 4, 4)))
    texts = {
        "robot": yaml_text(robot_data(robot, source=f"modrob assemble {item.files[0].name}")),
        "dh": tables.dh_csv(),
        "dynpar": tables.dynpar_csv(),
        "intervals": tables.intervals_csv(),
        "urdf": urdf_text(robot, in_link.mass, in_link.com, in_link.inertia_com),
    }
    if picture == "svg":
        texts["picture"] = svg_text(arm_picture(robot, q, link_paths(robot)))
    elif picture == "png":
        from modrob_cli.plot.png import save_png

        save_png(arm_picture(robot, q, link_paths(robot)), folder.stage(names["picture"]))
    outputs = {names[kind]: text_sha256(text) for kind, text in texts.items()}
    texts["manifest"] = json.dumps({**origin, "q": q.tolist(), "outputs": outputs}, indent=2) + "\n"
    for kind, text in texts.items():
        folder.write(names[kind], text)
    return AssembledRobot(tables, {kind: str(folder.folder / name) for kind, name in names.items()})
