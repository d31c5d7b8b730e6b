"""JUnit XML, which CI servers show as test results."""

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree


@dataclass(frozen=True)
class CheckCase:
    """One check: group and name, what failed (None: passed), what was measured; skipped if it was not judged."""

    group: str
    name: str
    failure: str | None
    output: str
    skipped: bool = False


def junit_text(suite: str, cases: Sequence[CheckCase]) -> str:
    """XML of one suite; names are escaped, characters that XML does not have are replaced."""
    counts = {
        "tests": str(len(cases)),
        "failures": str(sum(case.failure is not None for case in cases)),
        "errors": "0",
        "skipped": str(sum(case.skipped for case in cases)),
    }
    root = ElementTree.Element("testsuites")
    node = ElementTree.SubElement(root, "testsuite", {"name": _plain(suite), **counts})
    for case in cases:
        entry = ElementTree.SubElement(node, "testcase", {"classname": _plain(case.group), "name": _plain(case.name)})
        if case.skipped:
            ElementTree.SubElement(entry, "skipped")
        if case.failure is not None:
            ElementTree.SubElement(entry, "failure", {"message": _plain(case.failure)})
        ElementTree.SubElement(entry, "system-out").text = _plain(case.output)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() or c in "\n\t" else "?" for c in text)
