"""Documents as YAML text."""

from typing import Any

import yaml

_DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def yaml_text(data: dict[str, Any]) -> str:
    """Text of a document; numbers keep all their digits, short lists and mappings stay on one line."""
    return str(yaml.dump(data, Dumper=_DUMPER, sort_keys=False, default_flow_style=None, width=118, allow_unicode=True))
