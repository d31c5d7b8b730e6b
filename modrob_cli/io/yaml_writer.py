"""Documents as YAML text."""

from typing import Any

import yaml

from modrob_cli.io.yaml_scalars import plain_scalar

_BASE: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


class _Dumper(_BASE):  # type: ignore[misc]
    """Quotes text that the loader would take for something else, such as a module named 1e3."""


def _text(dumper: Any, value: str) -> Any:
    style = None if isinstance(plain_scalar(value), str) else "'"
    return dumper.represent_scalar("tag:yaml.org,2002:str", value, style=style)


_Dumper.add_representer(str, _text)


def yaml_text(data: dict[str, Any]) -> str:
    """Text of a document; numbers keep all their digits, short lists and mappings stay on one line."""
    return str(yaml.dump(data, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=118, allow_unicode=True))
