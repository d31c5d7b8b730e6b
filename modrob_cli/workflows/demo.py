"""``modrob demo``: the whole chain on the shipped example."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from modrob_cli.io.catalogue import yaml_files
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.workflows.assemble import AssembledRobot, assemble
from modrob_cli.workflows.bounds import bounds
from modrob_cli.workflows.bounds_method import BoundsOptions
from modrob_cli.workflows.check import CheckResult, check

MAIN_ROBOT = "lwa4p-6"
UNCERTAIN_ROBOT = "lwa4p-6-tol5"
PAYLOAD_ROBOT = "lwa4p-table34"
MOTION = "table-b1"
POSE = (0.3, -0.8, 1.6, 0.0, 0.8, 0.0)

_GUIDE = """# What `modrob demo` left here

| file | what it is |
|---|---|
| `robots/NAME.robot.yaml` | the assembled robot, every body with its own box; every command reads it |
| `robots/NAME.dh.csv` | extended D-H parameters at q = 0 [m, rad] |
| `robots/NAME.dynpar.csv` | nominal mass, centre of mass, inertia [kg, m, kg m^2] in the D-H frames, friction, drive |
| `robots/NAME.intervals.csv` | bounds of every parameter: the tight range, and the published interval synthesis |
| `robots/NAME.urdf` | nominal model for Pinocchio, RViz and others |
| `robots/NAME.svg` | the arm at q = 0 |
| `robots/NAME.manifest.json` | tool version, hashes of inputs and outputs |
| `pose/{main}.png` | the 6-axis arm at a bent pose, as PNG |
| `bounds/{motion}.bounds.png` | torque of the arm with an uncertain gripper along a published motion, with its bounds |
| `bounds/{motion}.bounds.csv` | the same as numbers |
| `bounds/{motion}.shares.csv` | how much each uncertain parameter widens the bounds |
| `bounds/{motion}.bounds.json` | the result with versions and hashes |

The inputs are the shipped `modules/`, `assemblies/` and `trajectories/`;
`modrob init DIR` copies them into a workspace of your own.
"""


@dataclass(frozen=True)
class DemoResult:
    """What the demo did."""

    checked: CheckResult
    robots: list[AssembledRobot]
    bounds: dict[str, Any]
    folder: Path

    def robot(self, name: str) -> AssembledRobot:
        """One of the robots by name."""
        return next(robot for robot in self.robots if robot.tables.robot.name == name)


def demo(out: Path, overwrite: bool, announce: Callable[[str], None]) -> DemoResult:
    """Check the shipped documents, assemble the shipped arms, draw one, bound its torques along a motion.

    ``announce`` is told each step.

    Raises
    ------
    OutputExistsError
        If files are there and ``overwrite`` is false.
    """
    modules, assemblies, trajectories = (shipped_folder(name) for name in ("modules", "assemblies", "trajectories"))
    announce("1. Check the shipped catalogue: modrob check modules assemblies trajectories")
    checked = check([modules, assemblies, trajectories])
    paths = list(yaml_files(assemblies))
    announce(f"2. Assemble the {len(paths)} shipped arms: modrob assemble assemblies/*.yaml -o {out}/robots")
    robots = assemble(paths, out / "robots", overwrite=overwrite)
    values = ",".join(f"{value:g}" for value in POSE)
    announce(f"3. Draw one: modrob assemble assemblies/{MAIN_ROBOT}.yaml --q {values} --picture png -o {out}/pose")
    main = next(path for path in paths if path.stem == MAIN_ROBOT)
    assemble([main], out / "pose", q=list(POSE), picture="png", overwrite=overwrite)
    payload, motion = assemblies / f"{PAYLOAD_ROBOT}.yaml", trajectories / f"{MOTION}.yaml"
    announce(f"4. Bound its torques along a motion: modrob bounds {payload.name} {motion.name} -o {out}/bounds")
    found = bounds(payload, motion, BoundsOptions(), out / "bounds", overwrite)
    with OutputFolder(out, overwrite) as folder:
        folder.write("README.md", _GUIDE.replace("{main}", MAIN_ROBOT).replace("{motion}", MOTION))
    return DemoResult(checked, robots, found, out)
