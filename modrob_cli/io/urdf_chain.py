"""From the joints of a URDF to one serial chain and its end effector."""

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.urdf_xml import MOVING, XmlJoint, XmlRobot


def serial_chain(robot: XmlRobot) -> tuple[list[XmlJoint], str]:
    """List the moving joints from base to tip, and find the link that is the end effector.

    The end effector is the link that most fixed joints separate from the last moving joint; of several, the one
    whose joint comes last in the file (``tool0`` in most descriptions).

    Raises
    ------
    InputFileError
        With all faults: unknown links, several roots, loops, branches, joints that cannot be modelled.
    """
    below, root = _tree(robot)
    for joint in robot.joints:
        if joint.kind not in (*MOVING, "fixed"):
            known = ", ".join((*MOVING, "fixed"))
            robot.fault(
                f"joint {joint.name}: found the type {ascii(joint.kind)[:40]}, expected one of {known}", joint.line
            )
        if "mimic" in joint.children:
            robot.fault(f"joint {joint.name}: found <mimic>; joints that follow others are not supported", joint.line)
    if robot.faults:
        raise InputFileError(robot.faults)
    chain: list[XmlJoint] = []
    link: str = root
    while True:
        reachable, depth = _rigid_part(below, link)
        ahead = [joint for part in reachable for joint in below.get(part, []) if joint.kind in MOVING]
        if len(ahead) > 1:
            names = ", ".join(joint.name for joint in ahead)
            message = f"found a branch: the joints {names} move on one rigid part; expected a serial arm"
            raise InputFileError(Fault(robot.file, message, line=ahead[1].line))
        if not ahead:
            break
        chain.append(ahead[0])
        link = ahead[0].child
    if not chain:
        raise InputFileError(Fault(robot.file, "found no moving joint, expected a serial arm"))
    order = {joint.child: index for index, joint in enumerate(robot.joints)}
    return chain, max(reachable, key=lambda part: (depth[part], order[part]))


def _tree(robot: XmlRobot) -> tuple[dict[str, list[XmlJoint]], str]:
    """Joints below each link, and the root link."""
    below: dict[str, list[XmlJoint]] = {}
    above: dict[str, XmlJoint] = {}
    for joint in robot.joints:
        for side, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in robot.links:
                robot.fault(f"joint {joint.name}: {side} link {ascii(link)[:60]} is not in the file", joint.line)
        if joint.child in above:
            message = f"link {joint.child} has two parents: joints {above[joint.child].name} and {joint.name}"
            robot.fault(message, joint.line)
        above[joint.child] = joint
        below.setdefault(joint.parent, []).append(joint)
    roots = [link for link in robot.links if link not in above]
    if len(roots) != 1:
        found = f"several root links: {', '.join(roots)}" if roots else "no root link (a loop, or no links at all)"
        robot.fault(f"found {found}; expected one link that is nobody's child")
    elif not robot.faults and len(_reachable(below, roots[0])) != len(robot.links):
        lost = sorted(set(robot.links) - _reachable(below, roots[0]))
        robot.fault(f"found a loop: links {', '.join(lost)} do not hang on the root {roots[0]}")
    return below, roots[0] if roots else ""


def _reachable(below: dict[str, list[XmlJoint]], root: str) -> set[str]:
    found = [root]
    for link in found:
        found.extend(joint.child for joint in below.get(link, []))
    return set(found)


def _rigid_part(below: dict[str, list[XmlJoint]], start: str) -> tuple[list[str], dict[str, int]]:
    """Links that fixed joints connect to a link, and how many joints away they are."""
    depth = {start: 0}
    reachable = [start]
    for link in reachable:
        for joint in below.get(link, []):
            if joint.kind == "fixed":
                depth[joint.child] = depth[link] + 1
                reachable.append(joint.child)
    return reachable, depth
