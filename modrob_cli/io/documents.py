"""From YAML files to checked documents, with every fault at its place."""

import difflib
import functools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.yaml_builder import Path_, first_faults, shorten
from modrob_cli.io.yaml_loader import YamlDocument, load_yaml
from modrob_cli.schema import DOCUMENTS, Document

D = TypeVar("D", bound=Document)

_SHOWN = 60


def read_document(path: Path, kind: type[D], loaded: YamlDocument | None = None) -> tuple[D, YamlDocument]:
    """Read a document of one kind; returns it with the YAML it came from (for places of later faults).

    ``loaded`` is the file's content where it has been loaded already.

    Raises
    ------
    InputFileError
        With all faults of the file.
    """
    loaded = loaded or load_yaml(path)
    document = check_document(loaded, expected=kind)
    if not isinstance(document, kind):
        raise TypeError(f"{type(document).__name__} is not {kind.__name__}")
    return document, loaded


def kind_of(loaded: YamlDocument) -> str | None:
    """Value of the key ``modrob``, if the document has one."""
    kind = loaded.data.get("modrob") if isinstance(loaded.data, dict) else None
    return kind if isinstance(kind, str) else None


def check_document(loaded: YamlDocument, expected: type[Document] | None = None) -> Document:
    """Check YAML data against the document kind that it names.

    Raises
    ------
    InputFileError
        If the kind is missing, unknown, or not ``expected``; or with all faults of the content.
    """
    wanted = [name for name, kind in DOCUMENTS.items() if expected in (None, kind)]
    if not isinstance(loaded.data, dict):
        message = f"found {_describe(loaded.data)}, expected a mapping that starts with 'modrob: {wanted[0]}'"
        raise InputFileError(loaded.fault((), message))
    found = loaded.data.get("modrob")
    if found is None:
        raise InputFileError(loaded.fault((), f"the key modrob is missing; start with 'modrob: {wanted[0]}'"))
    if found not in wanted:
        message = f"found {_describe(found)}, expected {' or '.join(wanted)}"
        raise InputFileError(loaded.fault(("modrob",), message))
    kind = DOCUMENTS[found]
    try:
        return kind.model_validate(loaded.data)
    except ValidationError as error:
        raise InputFileError(_faults(error, loaded, kind)) from error


def check_part(loaded: YamlDocument, path: Path_, kind: type[D]) -> D:
    """Check the part of YAML data at a path, which exists, against a kind without the key ``modrob``.

    Raises
    ------
    InputFileError
        With all faults of the part.
    """
    part = functools.reduce(lambda node, step: node[step], path, loaded.data)
    try:
        return kind.model_validate(part)
    except ValidationError as error:
        raise InputFileError(_faults(error, loaded, kind, path)) from error


def _faults(error: ValidationError, loaded: YamlDocument, kind: type[Document], base: Path_ = ()) -> list[Fault]:
    faults = []
    for item in error.errors(include_url=False):
        path = _known_path((*base, *item["loc"]), loaded, missing=item["type"] == "missing")
        faults.append(loaded.fault(path, _message(dict(item), path[len(base) :], kind)))
    return first_faults(sorted(dict.fromkeys(faults), key=lambda fault: (fault.line or 0, fault.column or 0)))


def _known_path(loc: Path_, loaded: YamlDocument, missing: bool) -> Path_:
    """Return the part of pydantic's location that the file has (validators add steps of their own)."""
    node = loaded.data
    for k, step in enumerate(loc):
        inside = step in node if isinstance(node, dict) else isinstance(node, list) and step in range(len(node))
        if not inside:
            return (*loc[:k], loc[-1]) if missing else loc[:k]
        node = node[step]
    return loc


def _message(item: dict[str, Any], path: Path_, kind: type[Document]) -> str:
    if item["type"] == "missing":
        return "required key is missing"
    if item["type"] == "extra_forbidden":
        known = _known_keys(kind, path[:-1])
        close = difflib.get_close_matches(str(path[-1])[:_SHOWN], known, n=1)
        hint = f"did you mean {close[0]}?" if close else f"known keys: {', '.join(known)}"
        return f"unknown key {_describe(path[-1])}; {hint}"
    expected = re.sub(r"^(Input|String|List) should ", "expected it to ", item["msg"])
    expected = expected.replace("expected it to be", "expected").replace("expected it to have", "expected")
    expected = re.sub(r" after validation, not .*", "", expected)
    if item["type"] == "string_pattern_mismatch":
        expected = "expected a name of letters, digits, _ + or -, at most 64, starting with a letter or digit"
    return f"found {_describe(item['input'])}, {expected}"


def _describe(value: Any) -> str:
    """Short text for a value from a file, safe for a terminal."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if value is None:
        return "nothing"
    if hasattr(value, "nominal"):
        return _describe(value.nominal)
    return shorten(value, _SHOWN) if isinstance(value, str) else str(value)[:_SHOWN]


@functools.lru_cache(maxsize=1000)
def _known_keys(kind: type[Document], path: Path_) -> list[str]:
    """Keys that a document kind knows at a path, sorted."""
    schema = _json_schema(kind)
    nodes = list(_variants(schema, schema))
    for step in path:
        nodes = [inner for node in nodes for inner in _step(schema, node, step)]
    return sorted({key for node in nodes for key in node.get("properties", {})})


@functools.cache
def _json_schema(kind: type[Document]) -> dict[str, Any]:
    return kind.model_json_schema()


def _step(root: dict[str, Any], node: dict[str, Any], step: str | int) -> Iterator[dict[str, Any]]:
    if isinstance(step, int):
        below = node.get("items")
    else:
        below = node.get("properties", {}).get(step, node.get("additionalProperties"))
        below = below if below is not None else next(iter(node.get("patternProperties", {}).values()), None)
    if isinstance(below, dict):
        yield from _variants(root, below)


def _variants(root: dict[str, Any], node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the schema itself or, behind references and alternatives, what it may be."""
    if "$ref" in node:
        yield from _variants(root, root["$defs"][node["$ref"].rsplit("/", 1)[-1]])
    elif "anyOf" in node:
        for option in node["anyOf"]:
            yield from _variants(root, option)
    else:
        yield node
