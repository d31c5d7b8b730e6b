"""Scenario documents on the command line."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.documents import read_document
from modrob_cli.io.python_controller import compile_controller, controller_file
from modrob_cli.io.yaml_loader import YamlDocument
from modrob_cli.model.robot import Robot
from modrob_cli.model.scenario import Scenario
from modrob_cli.schema.scenario import ScenarioDocument
from modrob_cli.simulate.controllers.shipped import CONTROLLERS


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario for one robot, and the files it was read from."""

    scenario: Scenario
    files: list[Path]


def load_scenario(path: Path | None, robot: Robot) -> LoadedScenario:
    """Read a ``scenario/1`` document; without one, everything has its default.

    A controller in a Python file is named by its path from here, not from the document.

    Raises
    ------
    InputFileError
        With all faults of the document, those that only the robot shows included.
    """
    if path is None:
        return LoadedScenario(Scenario(), [])
    document, text = read_document(path, ScenarioDocument)
    faults = [text.fault(where, message) for where, message in document.robot_faults(robot)]
    faults += controller_faults(path, document, text)
    if faults:
        raise InputFileError(sorted(faults, key=lambda fault: (fault.line or 0, fault.column or 0)))
    scenario = document.to_model(robot)
    control = replace(scenario.control, name=_controller_from_here(path, scenario.control.name))
    return LoadedScenario(replace(scenario, control=control), [path])


def controller_faults(path: Path, document: ScenarioDocument, text: YamlDocument) -> Iterator[Fault]:
    """What is wrong with the controller that a document names; a Python file is compiled, not run."""
    where = ("control", "name")
    name = document.control.name
    try:
        found = controller_file(name) if name is not None else None
        if found is not None:
            compile_controller(path.parent / found[0])
        elif name is not None and name not in CONTROLLERS:
            shipped = ", ".join(CONTROLLERS)
            yield text.fault(
                where, f"found {ascii(name)}, expected {shipped}, or a Python file such as my_controller.py"
            )
    except UsageError as error:
        yield text.fault(where, str(error))
    except InputFileError as error:
        yield from (text.fault(where, str(fault)) for fault in error.faults)


def _controller_from_here(path: Path, name: str | None) -> str | None:
    """Name of a controller where a Python file is not relative to the document any more."""
    found = controller_file(name) if name is not None else None
    return name if found is None else f"{path.parent / found[0]}:{found[1]}"
