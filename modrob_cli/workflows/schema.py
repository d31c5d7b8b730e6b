"""JSON Schemas of the documents."""

from typing import Any

from modrob_cli.errors import UsageError
from modrob_cli.schema import DOCUMENTS

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema(kind: str) -> dict[str, Any]:
    """JSON Schema of a document kind, given as ``module/1`` or ``module``.

    Raises
    ------
    UsageError
        If there is no such kind; the message lists them.
    """
    names = {short: name for name in DOCUMENTS for short in (name, name.split("/", 1)[0])}
    if kind not in names:
        raise UsageError(f"found the unknown kind {ascii(kind)}, expected one of: {', '.join(DOCUMENTS)}")
    name = names[kind]
    return {"$schema": DIALECT, **DOCUMENTS[name].model_json_schema(), "title": f"modrob {name}"}
