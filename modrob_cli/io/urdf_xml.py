"""The XML side of a URDF: well-formed, plain, complete.

Checked here with line numbers, because the parser behind Pinocchio says little and goes on with made-up values where
a number is missing.
"""

import math
from dataclasses import dataclass, field
from xml.parsers import expat

from modrob_cli.errors import Fault, InputFileError

MOVING = ("revolute", "continuous", "prismatic")
MAX_DEPTH = 64

REQUIRED = {
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "limit": ("effort", "velocity"),
    "parent": ("link",),
    "child": ("link",),
    "mimic": ("joint",),
    "axis": ("xyz",),
}
"""Attributes that the elements inside <inertial> and <joint> must have."""


@dataclass
class XmlJoint:
    """One <joint> of a URDF: its place in the text and the attributes of its children elements."""

    name: str
    kind: str
    line: int
    children: dict[str, dict[str, str]] = field(default_factory=dict)

    @property
    def parent(self) -> str:
        """Name of the parent link."""
        return self.children.get("parent", {}).get("link", "")

    @property
    def child(self) -> str:
        """Name of the child link."""
        return self.children.get("child", {}).get("link", "")


@dataclass
class XmlRobot:
    """Joints and links of a URDF in the order of the file; lines of the links."""

    file: str
    name: str = ""
    joints: list[XmlJoint] = field(default_factory=list)
    links: dict[str, int] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)

    def fault(self, message: str, line: int | None = None) -> None:
        """Note a fault."""
        self.faults.append(Fault(self.file, message, line=line))


def scan(text: str, file: str) -> XmlRobot:
    """Read the elements of a URDF that decide about its structure.

    Raises
    ------
    InputFileError
        If the text is not well-formed XML, has a document type declaration, or its root is not <robot>; or with all
        faults of its elements: no name, repeated names, numbers that are none.
    """
    reader = _Reader(XmlRobot(file))
    parser = expat.ParserCreate()
    reader.parser = parser
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.StartDoctypeDeclHandler = reader.refuse_doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        message = f"not well-formed XML: {expat.ErrorString(error.code)}"
        raise InputFileError(Fault(file, message, line=error.lineno, column=error.offset + 1)) from error
    if reader.robot.faults:
        raise InputFileError(reader.robot.faults)
    return reader.robot


class _Reader:
    """Handlers of the XML parser."""

    parser: expat.XMLParserType

    def __init__(self, robot: XmlRobot) -> None:
        self.robot = robot
        self.open: list[str] = []
        self.joint: XmlJoint | None = None
        self.link = ""
        self.inertial: dict[str, dict[str, str]] = {}
        self.joint_lines: dict[str, int] = {}

    def _stop(self, message: str) -> None:
        raise InputFileError(Fault(self.robot.file, message, line=self.parser.CurrentLineNumber))

    def refuse_doctype(self, *_: object) -> None:
        self._stop("found a document type declaration (<!DOCTYPE), which a URDF must not have; remove it")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self.parser.CurrentLineNumber
        if not self.open:
            if tag != "robot":
                self._stop(f"found the root element <{ascii(tag)[1:-1][:40]}>, expected <robot>: is this a URDF?")
            self.robot.name = attributes.get("name", "")
            if not self.robot.name:
                self.robot.fault("found no name in <robot>, expected <robot name=...>", line)
        if tag.startswith("xacro:"):
            self._stop(f"found <{tag}>, expected plain URDF; expand it first: xacro FILE > FILE.urdf")
        if len(self.open) >= MAX_DEPTH:
            self._stop(f"found elements nested deeper than {MAX_DEPTH} levels")
        if self.open == ["robot"] and tag == "link":
            self._start_link(attributes.get("name", ""), line)
        elif self.open == ["robot"] and tag == "joint":
            self._start_joint(attributes, line)
        elif self.joint is not None and self.open == ["robot", "joint"]:
            self.joint.children[tag] = attributes
            self._check(tag, attributes, f"joint {self.joint.name}", line)
        elif self.open == ["robot", "link", "inertial"]:
            self.inertial[tag] = attributes
            self._check(tag, attributes, f"link {self.link}", line)
        self.open.append(tag)

    def end(self, tag: str) -> None:
        self.open.pop()
        line = self.parser.CurrentLineNumber
        if tag == "inertial" and self.open == ["robot", "link"]:
            self._require(("mass", "inertia"), self.inertial, f"link {self.link}", line)
            self.inertial = {}
        if self.open == ["robot"] and self.joint is not None:
            needed = (
                ("parent", "child", "limit") if self.joint.kind in ("revolute", "prismatic") else ("parent", "child")
            )
            self._require(needed, self.joint.children, f"joint {self.joint.name}", self.joint.line)
            self.joint = None

    def _require(self, tags: tuple[str, ...], found: dict[str, dict[str, str]], owner: str, line: int) -> None:
        missing = ", ".join(f"<{tag}>" for tag in tags if tag not in found)
        if missing:
            self.robot.fault(f"{owner}: {missing} is missing", line)

    def _start_link(self, name: str, line: int) -> None:
        if not name:
            self.robot.fault("found a link without a name", line)
        elif name in self.robot.links:
            self.robot.fault(f"found the link {name} again (first on line {self.robot.links[name]})", line)
        self.robot.links.setdefault(name, line)
        self.link = name

    def _start_joint(self, attributes: dict[str, str], line: int) -> None:
        name = attributes.get("name", "")
        self.joint = XmlJoint(name, attributes.get("type", ""), line)
        if not name:
            self.robot.fault("found a joint without a name", line)
        elif name in self.joint_lines:
            self.robot.fault(f"found the joint {name} again (first on line {self.joint_lines[name]})", line)
        self.joint_lines.setdefault(name, line)
        self.robot.joints.append(self.joint)

    def _check(self, tag: str, attributes: dict[str, str], owner: str, line: int) -> None:
        """Fault missing attributes, numbers that are not finite, an axis of length zero, a negative mass."""
        missing = ", ".join(key for key in REQUIRED.get(tag, ()) if key not in attributes)
        if missing:
            self.robot.fault(f"{owner}: <{tag}> lacks {missing}", line)
        if tag not in ("origin", "axis", "limit", "dynamics", "mass", "inertia"):
            return
        count = 3 if tag in ("origin", "axis") else 1
        for key, text in attributes.items():
            values = numbers(text)
            if len(values) != count or not all(math.isfinite(value) for value in values):
                expected = "three finite numbers" if count == 3 else "a finite number"
                self.robot.fault(f"{owner}: found {key}={ascii(text)[:60]} in <{tag}>, expected {expected}", line)
            elif tag == "axis" and math.hypot(*values) < 1e-6:
                self.robot.fault(f"{owner}: found the axis {text}, expected a direction", line)
            elif tag == "mass" and values[0] < 0.0:
                self.robot.fault(f"{owner}: found the mass {text} kg, expected a number >= 0", line)


def numbers(text: str) -> list[float]:
    """Numbers of an attribute; NaN for what is none."""
    out = []
    for part in text.split():
        try:
            out.append(math.nan if "_" in part else float(part))  # float() takes 1_000, the URDF parser does not
        except ValueError:
            out.append(math.nan)
    return out
