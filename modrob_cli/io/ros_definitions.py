"""Texts of ROS 2 message definitions (``ros2msg``), as MCAP files carry them, taken apart.

https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html
"""

import re
from dataclasses import dataclass

SIZES = {
    **dict.fromkeys(("bool", "byte", "char", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float32"), 4),
    **dict.fromkeys(("int64", "uint64", "float64"), 8),
}
"""Bytes of the primitive types."""

_FIELD = re.compile(
    r"(?P<type>[\w/]+)(?P<bound><=\d+)?(?P<array>\[(?P<limit><=)?(?P<length>\d*)\])?\s+(?P<name>\w+)(?P<rest>.*)"
)
_BUILT_IN = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
}
"""Types that some writers leave out of the text."""


@dataclass(frozen=True)
class RosField:
    """One field.

    Attributes
    ----------
    type : a primitive, ``string``, ``wstring``, or the name of a type as ``package/Name``
    is_list : a list with its length in the message;  length : of an array of fixed length; None for one value
    """

    name: str
    type: str
    is_list: bool = False
    length: int | None = None


Definitions = dict[str, tuple[RosField, ...]]


def parse_definitions(name: str, text: str) -> Definitions:
    """Fields of the type ``name`` and of all types that the text defines, by name as ``package/Name``.

    Raises
    ------
    ValueError
        If the text is no definition, or a type is missing.
    """
    package = name.split("/")[0]
    parts = re.split(r"^=+[ \t]*$", text, flags=re.MULTILINE)
    out = {_short(name): _fields(parts[0], package)}
    for part in parts[1:]:
        head, _, body = part.strip().partition("\n")
        if not head.startswith("MSG:"):
            raise ValueError("found no MSG: after a line of = in the definition")
        inner = _short(head[4:].strip())
        out[inner] = _fields(body, inner.split("/")[0])
    for inner, body in _BUILT_IN.items():
        out.setdefault(inner, _fields(body, inner.split("/")[0]))
    for fields in out.values():
        for field in fields:
            if field.type not in SIZES and field.type not in ("string", "wstring") and field.type not in out:
                raise ValueError(f"the definition lacks the type {field.type}")
    return out


def _short(name: str) -> str:
    """``package/Name`` for ``package/msg/Name``."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[-1]}"


def _fields(text: str, package: str) -> tuple[RosField, ...]:
    out = []
    for raw in text.splitlines():
        line = raw.split("#")[0].strip()
        if not line:
            continue
        match = _FIELD.fullmatch(line)
        if match is None:
            raise ValueError(f"found {line[:60]!r}, which is no field of a message")
        if match["rest"].strip().startswith("="):
            continue  # a constant
        kind = match["type"]
        if kind == "Header":
            kind = "std_msgs/Header"
        elif kind not in SIZES and kind not in ("string", "wstring"):
            kind = _short(kind if "/" in kind else f"{package}/{kind}")
        length = int(match["length"]) if match["array"] and match["length"] and not match["limit"] else None
        out.append(RosField(match["name"], kind, bool(match["array"]) and length is None, length))
    return tuple(out)
