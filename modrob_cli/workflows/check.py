"""``modrob check``: every fault and every implausibility of documents."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modrob_cli.assembly.synthesis import synthesize
from modrob_cli.errors import Fault, InputFileError, ModrobError
from modrob_cli.io.catalogue import Catalogue, read_assembly, yaml_files
from modrob_cli.io.documents import check_document, kind_of
from modrob_cli.io.yaml_loader import YamlDocument, is_folder, load_yaml
from modrob_cli.model.plausibility import Remark, assembly_remarks, module_remarks, payload_remarks, robot_remarks
from modrob_cli.schema import AssemblyDocument, ModuleDocument, RobotDocument, ScenarioDocument, TrajectoryDocument
from modrob_cli.workflows.scenarios import controller_faults


@dataclass(frozen=True)
class Warned:
    """A remark at its place; ``level`` as in :class:`modrob_cli.model.plausibility.Remark`."""

    fault: Fault
    level: str


@dataclass(frozen=True)
class CheckedFile:
    """What was found in one file.

    Attributes
    ----------
    file : path as the user would write it
    kind : value of the key ``modrob``; None where it cannot be read
    faults : why the document cannot be used; those of an assembly may lie in the files of its catalogue
    warnings : what is physically implausible in it
    """

    file: str
    kind: str | None
    faults: tuple[Fault, ...] = ()
    warnings: tuple[Warned, ...] = ()


@dataclass(frozen=True)
class CheckResult:
    """All files that were checked, and those that assemblies among them use."""

    files: tuple[CheckedFile, ...]

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Every fault once, in the order of the files."""
        return tuple(dict.fromkeys(fault for checked in self.files for fault in checked.faults))

    @property
    def warnings(self) -> tuple[Warned, ...]:
        """Every warning, in the order of the files."""
        return tuple(warned for checked in self.files for warned in checked.warnings)

    def is_ok(self, strict: bool) -> bool:
        """True without faults; for ``strict`` also without warnings."""
        return not self.faults and not (strict and self.warnings)


def check(paths: list[Path]) -> CheckResult:
    """Check documents and folders of documents, each file once.

    Folders are searched for ``*.yaml`` and ``*.yml``, hidden ones left out, links to folders not followed. An
    assembly is checked with its catalogue, and the modules that it uses are checked too.
    """
    catalogue = Catalogue()
    checked: list[CheckedFile] = []
    waiting: deque[Path] = deque()
    for path in paths:
        try:
            waiting.extend(_documents(path))
        except InputFileError as error:
            checked.append(CheckedFile(str(path), None, error.faults))
    seen: set[Path] = set()
    while waiting:
        path = waiting.popleft()
        identity = path.absolute()
        if identity not in seen:
            seen.add(identity)
            result, used = _check_file(path, catalogue)
            checked.append(result)
            waiting.extend(used)
    return CheckResult(tuple(checked))


def _documents(path: Path) -> list[Path]:
    if not is_folder(path):
        return [path]
    found = sorted(yaml_files(path))
    if not found:
        message = "found no document in this folder, expected at least one *.yaml or *.yml; check the path"
        raise InputFileError(Fault(str(path), message))
    return found


def _check_file(path: Path, catalogue: Catalogue) -> tuple[CheckedFile, list[Path]]:
    """Result for one file, and the files that it uses."""
    kind: str | None = None
    used: list[Path] = []
    try:
        loaded = load_yaml(path)
        kind = kind_of(loaded)
        with np.errstate(all="ignore"):  # absurd sizes are remarked upon, not computed with
            remarks, used = _remarks(path, loaded, catalogue)
            warnings = tuple(_warned(remark, loaded) for remark in remarks)
    except InputFileError as error:
        return CheckedFile(str(path), kind, error.faults), used
    except ModrobError as error:
        return CheckedFile(str(path), kind, (Fault(str(path), str(error)),)), used
    return CheckedFile(str(path), kind, warnings=warnings), used


def _remarks(path: Path, loaded: YamlDocument, catalogue: Catalogue) -> tuple[Iterator[Remark], list[Path]]:
    document = check_document(loaded)
    if isinstance(document, ModuleDocument):
        return module_remarks(document.to_model()), []
    if isinstance(document, RobotDocument):
        return robot_remarks(document.to_model(), document.payload is not None), []
    if isinstance(document, AssemblyDocument):
        found = read_assembly(path, catalogue)
        return assembly_remarks(found.assembly, synthesize(found.assembly)), found.files[1:]
    if isinstance(document, ScenarioDocument):
        return _scenario_remarks(path, document, loaded), []
    if isinstance(document, TrajectoryDocument):
        document.to_model()
    return iter(()), []


def _scenario_remarks(path: Path, document: ScenarioDocument, loaded: YamlDocument) -> Iterator[Remark]:
    """Remarks on the payload; faults of the controller are raised. What fits a robot is not known here."""
    faults = list(controller_faults(path, document, loaded))
    if faults:
        raise InputFileError(faults)
    return payload_remarks(document.payload.to_model("payload")) if document.payload else iter(())


def _warned(remark: Remark, loaded: YamlDocument) -> Warned:
    return Warned(loaded.fault(remark.where, remark.message), remark.level)
