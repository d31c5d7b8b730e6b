"""Assemblies with the module files that they name, and the faults of the chain as a whole."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.documents import check_document, kind_of, read_document
from modrob_cli.io.yaml_loader import YamlDocument, is_folder, is_same_file, load_yaml
from modrob_cli.model.module import Assembly, Module
from modrob_cli.schema import AssemblyDocument, ModuleDocument

SUFFIXES = (".yaml", ".yml")
MAX_FILES = 5_000


@dataclass(frozen=True)
class LoadedModule:
    """A module and where it was read."""

    module: Module
    path: Path


@dataclass(frozen=True)
class LoadedAssembly:
    """An assembly and every file that it was read from (itself first)."""

    assembly: Assembly
    files: list[Path]


class Catalogue:
    """Modules by name, read once per process run however many assemblies use them."""

    def __init__(self) -> None:
        self._modules: dict[Path, LoadedModule | InputFileError | None] = {}
        self._folders: dict[Path, list[Path]] = {}

    def module(self, path: Path, required: bool) -> LoadedModule | None:
        """Module of one file; None for a document of another kind found in a folder.

        Raises
        ------
        InputFileError
            If the file is not a good ``module/1``; for ``required`` files also if it is of another kind.
        """
        if path not in self._modules:
            self._modules[path] = self._read(path)
        found = self._modules[path]
        if isinstance(found, InputFileError):
            raise found
        if found is None and required:
            check_document(load_yaml(path), ModuleDocument)
        return found

    def _read(self, path: Path) -> LoadedModule | InputFileError | None:
        try:
            loaded = load_yaml(path)
            if kind_of(loaded) in ("assembly/1", "robot/1"):
                return None
            document = check_document(loaded, ModuleDocument)
        except InputFileError as error:
            return error
        return LoadedModule(document.to_model(), path) if isinstance(document, ModuleDocument) else None

    def files(self, folder: Path) -> list[Path]:
        """YAML files below a folder, sorted."""
        if folder not in self._folders:
            self._folders[folder] = sorted(yaml_files(folder))
        return self._folders[folder]


def yaml_files(folder: Path) -> Iterator[Path]:
    """YAML files below a folder; hidden ones and folders reached through links are left out.

    Raises
    ------
    InputFileError
        If there are more than 5000.
    """
    count = 0
    for root, folders, names in os.walk(folder, followlinks=False):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(names):
            if name.endswith(SUFFIXES) and not name.startswith("."):
                count += 1
                if count > MAX_FILES:
                    message = f"found more than {MAX_FILES} YAML files; name a smaller folder"
                    raise InputFileError(Fault(str(folder), message))
                yield Path(root) / name


def read_assembly(path: Path, catalogue: Catalogue | None = None, loaded: YamlDocument | None = None) -> LoadedAssembly:
    """Read an assembly and the modules of its chain; ``loaded`` is its content where it has been loaded already.

    Raises
    ------
    InputFileError
        With all faults of the assembly, of its catalogue, and of the chain.
    """
    document, loaded = read_document(path, AssemblyDocument, loaded)
    modules = _collect(document, loaded, path, catalogue or Catalogue())
    faults = list(_chain_faults(document, modules, loaded))
    if faults:
        raise InputFileError(faults)
    chain = [modules[use.module] for use in document.modules]
    files = [path, *dict.fromkeys(found.path for found in chain)]
    return LoadedAssembly(document.to_model([found.module for found in chain]), files)


def _collect(
    document: AssemblyDocument, loaded: YamlDocument, path: Path, catalogue: Catalogue
) -> dict[str, LoadedModule]:
    """Modules of the catalogue by name."""
    modules: dict[str, LoadedModule] = {}
    faults: list[Fault] = []
    for k, entry in enumerate(document.catalogue):
        place = ("catalogue", k) if ("catalogue", k) in loaded.marks else ("catalogue",)
        target = Path(os.path.normpath(path.parent / entry))
        try:
            for file, required in _entry_files(target, path, catalogue):
                found = catalogue.module(file, required)
                if found is None or modules.get(found.module.name, found).path == file:
                    if found is not None:
                        modules[found.module.name] = found
                    continue
                other = modules[found.module.name].path
                message = f"the module name {found.module.name} is taken by {other} already; rename one of them"
                faults.append(Fault(str(file), message, "$.name"))
        except InputFileError as error:
            faults.append(loaded.fault(place, f"the catalogue {ascii(entry)[1:-1]} cannot be used:"))
            faults.extend(error.faults)
    if faults:
        raise InputFileError(dict.fromkeys(faults))
    return modules


def _entry_files(target: Path, assembly: Path, catalogue: Catalogue) -> list[tuple[Path, bool]]:
    """Files of one catalogue entry, each with whether it has to be a module."""
    if not is_folder(target):
        if is_same_file(target, assembly):
            message = "is the assembly itself (a cycle of file references); name a folder or files of modules"
            raise InputFileError(Fault(str(target), message))
        return [(target, True)]
    files = catalogue.files(target)
    if not files:
        raise InputFileError(Fault(str(target), "found no YAML file in this folder, expected module/1 documents"))
    return [(file, False) for file in files if not is_same_file(file, assembly)]


def _chain_faults(
    document: AssemblyDocument, modules: dict[str, LoadedModule], loaded: YamlDocument
) -> Iterator[Fault]:
    """Everything that is wrong with the order of the modules and with what refers to their joints."""
    ended_by = ""
    joints: list[str] = []
    seen: dict[str, int] = {}
    for k, use in enumerate(document.modules):
        found = modules.get(use.module)
        place = ("modules", k)
        if found is None:
            known = ", ".join(sorted(modules)) or "none"
            yield loaded.fault(place, f"found the unknown module {use.module!r}, expected one of: {known}")
            continue
        module = found.module
        yield from _output_fault(module, use.output, place, loaded)
        if module.kind == "base" and k > 0:
            yield loaded.fault(
                place, f"found the base {module.name} as module {k + 1}, expected a base only as the first"
            )
        if ended_by:
            yield loaded.fault(
                place, f"found {module.name} after the end effector {ended_by}, expected it to be the last"
            )
        if module.kind == "end-effector":
            ended_by = module.name
        seen[module.name] = seen.get(module.name, 0) + 1
        name = module.name if seen[module.name] == 1 else f"{module.name}#{seen[module.name]}"
        joints += [f"{name}.{unit}" for unit in range(1, len(module.units) + 1)]
    if all(use.module in modules for use in document.modules):
        yield from _joint_faults(document, joints, loaded)


def _output_fault(module: Module, output: str | None, place: tuple[str, int], loaded: YamlDocument) -> Iterator[Fault]:
    known = ", ".join(module.outputs)
    if module.kind == "joint":
        if output is not None:
            yield loaded.fault((*place, "output"), f"the joint module {module.name} has one output; leave this key out")
    elif output is None and len(module.outputs) > 1:
        message = f"the module {module.name} has several outputs; write {{module: {module.name}, output: ...}} with one"
        yield loaded.fault(place, f"{message} of: {known}")
    elif output is not None and output not in module.outputs:
        yield loaded.fault((*place, "output"), f"found the unknown connector {output!r}, expected one of: {known}")


def _joint_faults(document: AssemblyDocument, joints: list[str], loaded: YamlDocument) -> Iterator[Fault]:
    n = len(joints)
    if n == 0:
        yield loaded.fault(("modules",), "found no joint module, expected at least one")
    names = document.joint_names
    if names is not None and len(names) != n:
        yield loaded.fault(("joint_names",), f"found {len(names)} names, expected {n}, for: {', '.join(joints)}")
        names = None
    for joint in document.limits:
        known = names or joints
        if joint not in known:
            message = f"found limits of the unknown joint {joint!r}, expected one of: {', '.join(known)}"
            yield loaded.fault(("limits", joint), message)
    if len(document.disturbance) not in (1, n):
        count = len(document.disturbance)
        yield loaded.fault(("disturbance",), f"found {count} entries, expected one, or one for each of {n} joints")
