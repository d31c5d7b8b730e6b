"""On-module storage: documents into bytes and back."""

from dataclasses import dataclass, replace
from pathlib import Path

from modrob_cli.assembly.module_data import connection_data, unit_data
from modrob_cli.errors import UsageError
from modrob_cli.io.documents import read_document
from modrob_cli.io.module_storage import plain_losses, read_storage
from modrob_cli.io.module_storage_extended import encode_extended
from modrob_cli.io.module_storage_plain import encode_plain
from modrob_cli.io.module_storage_record import StoredModule, StoredUnit
from modrob_cli.io.module_storage_yaml import module_text
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.model.module import ConnectionData, JointUnit, ModuleKind
from modrob_cli.schema import ModuleDocument
from modrob_cli.schema.base import Name
from modrob_cli.schema.module import ConnectionSpec, UnitSpec


@dataclass(frozen=True)
class PackResult:
    """A written file, the module in it, its size, and what got lost."""

    path: Path
    module: StoredModule
    size: int
    warnings: list[str]


def pack(path: Path, out: Path, extended: bool = False, overwrite: bool = False) -> PackResult:
    """Write the on-module storage of a ``module/1`` document.

    Raises
    ------
    InputFileError
        If the document cannot be used, or does not fit into the storage.
    OutputExistsError
        If ``out`` exists and ``overwrite`` is false.
    """
    document, _ = read_document(path, ModuleDocument)
    module = stored_module(document)
    raw = encode_extended(module, str(path)) if extended else encode_plain(module, str(path))
    _write(out, raw, overwrite)
    return PackResult(out, module, len(raw), [] if extended else plain_losses(module))


def unpack(
    path: Path, out: Path, kind: ModuleKind | None = None, name: str | None = None, overwrite: bool = False
) -> PackResult:
    """Write the ``module/1`` document of on-module storage; ``kind`` and ``name`` are for the plain form.

    Raises
    ------
    InputFileError
        If the file is not a whole, sound module.
    UsageError
        If ``kind`` or ``name`` is missing, or given for the extended form.
    OutputExistsError
        If ``out`` exists and ``overwrite`` is false.
    """
    if name is not None:
        _check_name(name)
    module = read_storage(path, kind, name)
    text = module_text(module, path)
    _write(out, f"{_origin(path)}\n{text}", overwrite)
    assumed = name is not None and kind is None and module.kind == "link"
    message = "the plain form does not hold the kind; taken as a link, pass --kind for a base or an end effector"
    return PackResult(out, module, len(text), [message] if assumed else [])


def _check_name(name: str) -> None:
    from pydantic import TypeAdapter, ValidationError

    try:
        TypeAdapter(Name).validate_python(name)
    except ValidationError as error:
        expected = "expected letters, digits, _, + or -, at most 64, starting with a letter or digit"
        raise UsageError(f"--name: found {ascii(name)}, {expected}") from error


def _write(out: Path, content: str | bytes, overwrite: bool) -> None:
    if out.is_dir():
        raise UsageError(f"{out} is a folder; pass the name of a file with --out")
    with OutputFolder(out.parent, overwrite) as folder:
        folder.write(out.name, content)


def _origin(path: Path) -> str:
    """Comment that says where a document came from."""
    made = provenance([path])
    inputs = made["inputs"]
    hashes = inputs.values() if isinstance(inputs, dict) else ()
    return f"# unpacked by modrob {made['modrob']} from {ascii(path.name)[1:-1]}, {', '.join(hashes)}"


def stored_module(document: ModuleDocument) -> StoredModule:
    """Parameters of a document: as it gives them, or derived where it gives poses."""
    module = document.to_model()
    if document.units is not None:
        units = tuple(_unit(spec, unit) for spec, unit in zip(document.units, module.units, strict=True))
        return StoredModule(module.name, module.kind, document.source, document.description, units=units)
    connections = document.connections or {}
    outputs = {name: _connection(spec) for name, spec in connections.items()}
    body = next(iter(module.outputs.values())).body
    return StoredModule(module.name, module.kind, document.source, document.description, outputs, body)


def _connection(spec: ConnectionSpec) -> ConnectionData:
    if spec.pose is not None:
        return connection_data(spec.to_model())
    return ConnectionData(spec.a, spec.alpha, spec.p, spec.n, spec.delta_in, spec.delta_out)


def _unit(spec: UnitSpec, unit: JointUnit) -> StoredUnit:
    if spec.proximal.pose is not None or spec.distal.pose is not None:
        proximal, distal, offset = unit_data(unit)
    else:
        first, last = spec.proximal, spec.distal
        proximal = ConnectionData(first.a, first.alpha, first.p, first.n, delta_in=first.delta)
        distal = ConnectionData(last.a, last.alpha, last.p, last.n, delta_out=last.delta)
        offset = unit.joint.offset
    joint = replace(unit.joint, offset=offset)
    return StoredUnit(proximal, unit.proximal.body, joint, distal, unit.distal.body)
