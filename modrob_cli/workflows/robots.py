"""ROBOT on the command line: an assembly, a robot file or a URDF."""

from dataclasses import dataclass
from pathlib import Path

from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.errors import InputFileError
from modrob_cli.io.catalogue import Catalogue, read_assembly
from modrob_cli.io.documents import kind_of, read_document
from modrob_cli.io.yaml_loader import load_yaml
from modrob_cli.model.log import UsedLog
from modrob_cli.model.robot import Robot
from modrob_cli.schema import RobotDocument

URDF_SUFFIXES = (".urdf", ".xml")


@dataclass(frozen=True)
class LoadedRobot:
    """A robot, the files it was read from, and the logs that its values were fitted to."""

    robot: Robot
    files: list[Path]
    identified_from: tuple[UsedLog, ...] = ()


def load_robot(path: Path, catalogue: Catalogue | None = None) -> LoadedRobot:
    """Read a robot from an ``assembly/1``, a ``robot/1`` or a URDF file.

    Raises
    ------
    InputFileError
        If the file, or one that it refers to, cannot be used.
    """
    if path.suffix.lower() in URDF_SUFFIXES:
        from modrob_cli.io.urdf_reader import read_urdf

        return LoadedRobot(read_urdf(path), [path])
    loaded = load_yaml(path)
    kind = kind_of(loaded)
    if kind == "assembly/1":
        assembled = read_assembly(path, catalogue, loaded)
        return LoadedRobot(synthesize(assembled.assembly), assembled.files)
    if kind != "robot/1":
        message = "expected a robot: an assembly/1 or a robot/1 document, or a URDF file"
        if kind is None:
            raise InputFileError(loaded.fault((), f"the key modrob is missing; {message}"))
        raise InputFileError(loaded.fault(("modrob",), f"found {kind!r}, {message}"))
    document, _ = read_document(path, RobotDocument, loaded)
    used = tuple(UsedLog(item.log, item.sha256, item.start, item.end) for item in document.identified_from)
    return LoadedRobot(document.to_model(), [path], used)
