"""Files of on-module storage: which form, which kind, and what it cannot hold."""

from pathlib import Path

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.module_storage_extended import MAGIC, decode_extended
from modrob_cli.io.module_storage_plain import LINK_BYTES, UNIT_BYTES, decode_plain
from modrob_cli.io.module_storage_record import StoredModule, StoredUnit
from modrob_cli.model.joint import Limits
from modrob_cli.model.module import ModuleKind
from modrob_cli.model.uncertain import Uncertain

MAX_BYTES = 2**20
_LISTED = 4


def read_storage(file: Path, kind: ModuleKind | None, name: str | None) -> StoredModule:
    """Read a plain or an extended file.

    A plain file holds neither name nor kind: the name has to be given, the kind where the size leaves it open.

    Raises
    ------
    InputFileError
        If the file cannot be read or is not a whole, sound module.
    UsageError
        If name or kind are missing for a plain file, or given for an extended one.
    """
    raw = _read_bytes(file)
    if raw.startswith(MAGIC):
        if kind is not None or name is not None:
            raise UsageError(f"{file}: the extended form holds name and kind; leave out --name and --kind")
        return decode_extended(raw, file)
    kind = kind or _kind_by_size(len(raw), file)
    if name is None:
        raise UsageError(f"{file}: the plain form does not hold the module's name; pass --name NAME")
    return decode_plain(raw, file, kind, name)


def _read_bytes(file: Path) -> bytes:
    try:
        if file.is_dir():
            raise InputFileError(Fault(str(file), "found a folder, expected a file"))
        if not file.is_file():
            what = "is not a regular file" if file.exists() else "file not found"
            raise InputFileError(Fault(str(file), f"{what}; check the path"))
        size = file.stat().st_size
        if not 0 < size <= MAX_BYTES:
            message = f"found {size} bytes, expected 1 to {MAX_BYTES}; is this on-module storage?"
            raise InputFileError(Fault(str(file), message))
        return file.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputFileError(Fault(str(file), f"cannot be read: {reason}")) from error


def _kind_by_size(size: int, file: Path) -> ModuleKind:
    is_joint, is_link = size % UNIT_BYTES == 0, size % LINK_BYTES == 0
    if is_joint and is_link:
        message = f"{size} bytes are {size // UNIT_BYTES} joint units or {size // LINK_BYTES} outputs of a link module"
        raise UsageError(f"{file}: {message}; pass --kind joint or --kind link")
    if not is_joint and not is_link:
        message = (
            f"found {size} bytes that do not start with the mark of the extended form, expected a multiple of "
            f"{UNIT_BYTES} (joint units) or {LINK_BYTES} (output connectors); is it truncated or corrupt?"
        )
        raise InputFileError(Fault(str(file), message))
    return "joint" if is_joint else "link"


def plain_losses(module: StoredModule) -> list[str]:
    """What the plain form does not hold of a module, one sentence each."""
    losses = ["the name, source and description are not stored; unpack takes the name as --name"]
    if module.kind in ("base", "end-effector"):
        losses.append(f"the kind {module.kind} is not stored; unpack takes it as --kind {module.kind}")
    uncertain = [name for name, value in _quantities(module) if not value.is_exact]
    if uncertain:
        losses.append(f"bounds are not stored, nominal values only: {_listed(uncertain)}")
    if list(module.outputs) not in ([], ["out"]):
        losses.append(f"the output names are not stored, only their order: {', '.join(module.outputs)}")
    for k, unit in enumerate(module.units):
        lost = _lost_of_joint(unit)
        if lost:
            losses.append(f"units[{k}].joint: not stored: {', '.join(lost)}")
    return losses


def _lost_of_joint(unit: StoredUnit) -> list[str]:
    friction = unit.joint.friction
    lost = ["limits"] if unit.joint.limits != Limits() else []
    lost += [key for key in ("coulomb_band", "velocity_band") if getattr(friction, key) != 0.0]
    return lost + (["stiffness"] if unit.joint.drive.stiffness is not None else [])


def _quantities(module: StoredModule) -> list[tuple[str, Uncertain]]:
    bodies = [("body", module.body)] if module.body else []
    joints = []
    for k, unit in enumerate(module.units):
        bodies += [(f"units[{k}].proximal.body", unit.proximal_body), (f"units[{k}].distal.body", unit.distal_body)]
        friction = unit.joint.friction
        joints += [(f"units[{k}].joint.viscous", friction.viscous), (f"units[{k}].joint.coulomb", friction.coulomb)]
        joints.append((f"units[{k}].joint.rotor_inertia", unit.joint.drive.rotor_inertia))
    keys = ("mass", "com", "inertia")
    return joints + [(f"{place}.{key}", getattr(body, key)) for place, body in bodies for key in keys]


def _listed(names: list[str]) -> str:
    rest = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {rest} more" if rest > 0 else "")
