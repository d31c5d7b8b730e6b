"""Columns of a log in CSV, matched with the joints of a robot."""

import re
from collections.abc import Mapping, Sequence

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.yaml_builder import shorten

KINDS = ("q", "dq", "effort")
_COLUMN = re.compile(r"(q|dq|ddq|effort)(?:\.(.+)|([1-9][0-9]{0,3}))")


class LogColumns:
    """What the columns mean: ``places[kind]`` gives the column of each joint, -1 where there is none.

    ``cut`` becomes True if the last line is left out because it ends in the middle.
    """

    cut = False

    def __init__(self, file: str, header: list[str], wanted: Sequence[str] | None, renamed: Mapping[str, str]) -> None:
        self.count = len(header)
        found = [_COLUMN.fullmatch(cell) for cell in header[1:]]
        wrong = [cell for cell, match in zip(header[1:], found, strict=True) if match is None]
        repeated = sorted({cell for cell in header if header.count(cell) > 1})
        form = "t,q1,..,dq1,..,effort1,.. or t,q.NAME,..,dq.NAME,..,effort.NAME,.."
        if header[0] != "t" or wrong or repeated or not found:
            what = "no t as the first column" if header[0] != "t" else f"the columns {', '.join(wrong + repeated)}"
            if not (wrong or repeated) and header[0] == "t":
                what = "no columns but t"
            raise InputFileError(Fault(file, f"found {shorten(what)[1:-1]}, expected each once: {form}", line=1))
        keys = {(match[1], match[2] or match[3]): k for k, match in enumerate(found) if match is not None}
        labels = list(dict.fromkeys(label for _, label in keys))
        numbered = all(match is not None and match[3] for match in found)
        self.names, labels = self._joints(file, labels, numbered, wanted, renamed)
        self.places = {kind: [keys.get((kind, label), -1) for label in labels] for kind in KINDS}
        self.ignored = sorted({label for _, label in keys} - set(labels))
        if all(place < 0 for place in self.places["q"]):
            raise InputFileError(Fault(file, f"found no positions, expected {form}", line=1))

    def _joints(
        self, file: str, labels: list[str], numbered: bool, wanted: Sequence[str] | None, renamed: Mapping[str, str]
    ) -> tuple[tuple[str, ...], list[str]]:
        """Names of the joints and how the header labels them."""
        if numbered and wanted is not None and not renamed:
            if len(labels) != len(wanted):
                message = f"found columns for {len(labels)} joints, expected {len(wanted)}: {', '.join(wanted)}"
                raise InputFileError(Fault(file, message, line=1))
            return tuple(wanted), [str(k + 1) for k in range(len(wanted))]
        original = {f"joint{label}" if numbered else label: label for label in labels}
        names = {renamed.get(name, name): label for name, label in original.items()}
        unused = [name for name in renamed if name not in original]
        if unused or len(names) < len(original):
            fault = f"--map renames {', '.join(unused)}" if unused else "--map gives two joints one name"
            raise InputFileError(Fault(file, f"{fault}; the log has {', '.join(original)}", line=1))
        chosen = tuple(names) if wanted is None else tuple(wanted)
        missing = [name for name in chosen if name not in names]
        if missing:
            message = f"joints of the robot are not in the log: {', '.join(missing)}; the log has {', '.join(names)}"
            raise InputFileError(Fault(file, f"{message}; rename them with --map LOG=ROBOT,...", line=1))
        return chosen, [names[name] for name in chosen]
