"""What a plain YAML scalar means: the core schema of YAML 1.2, without the surprises of 1.1.

``1e-3`` is a number, ``no`` and ``012-a`` are strings, ``012`` is twelve, dates stay strings.
"""

import math
import re

Scalar = str | int | float | bool | None

_INTEGER = re.compile(r"[-+]?[0-9]+\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_SPECIAL: dict[str, Scalar] = {
    "": None,
    "~": None,
    "null": None,
    "true": True,
    "false": False,
    ".nan": math.nan,
    ".inf": math.inf,
    "+.inf": math.inf,
    "-.inf": -math.inf,
}
_LONGEST_INTEGER = 18


def plain_scalar(text: str) -> Scalar:
    """Value of an unquoted scalar; text that is nothing else stays text.

    Integers beyond 18 digits become floats (which may be infinite), so that no input costs quadratic time.
    """
    lowered = text.lower()
    if lowered in _SPECIAL and text in (lowered, lowered.title(), lowered.upper(), ".NaN", "+.Inf", "-.Inf", ".Inf"):
        return _SPECIAL[lowered]
    if _INTEGER.match(text) and len(text) <= _LONGEST_INTEGER:
        return int(text)
    if _FLOAT.match(text):
        return float(text)
    return text
