"""``modrob demo``: the whole chain on the shipped example."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from modrob_cli.io.catalogue import yaml_files
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.workflows.assemble import AssembledRobot, assemble
from modrob_cli.workflows.check import CheckResult, check

MAIN_ROBOT = "lwa4p-6"
UNCERTAIN_ROBOT = "lwa4p-6-tol5"
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

The inputs are the shipped `modules/` and `assemblies/`; `modrob init DIR` copies them into a workspace of your own.
"""


@dataclass(frozen=True)
class DemoResult:
    """What the demo did."""

    checked: CheckResult
    robots: list[AssembledRobot]
    folder: Path

    def robot(self, name: str) -> AssembledRobot:
        """One of the robots by name."""
        return next(robot for robot in self.robots if robot.tables.robot.name == name)


def demo(out: Path, overwrite: bool, announce: Callable[[str], None]) -> DemoResult:
    """Check the shipped documents, assemble the shipped arms, draw one; ``announce`` is told each step.

    Raises
    ------
    OutputExistsError
        If files are there and ``overwrite`` is false.
    """
    modules, assemblies = shipped_folder("modules"), shipped_folder("assemblies")
    announce("1. Check the shipped catalogue: modrob check modules assemblies")
    checked = check([modules, assemblies])
    paths = list(yaml_files(assemblies))
    announce(f"2. Assemble the {len(paths)} shipped arms: modrob assemble assemblies/*.yaml -o {out}/robots")
    robots = assemble(paths, out / "robots", overwrite=overwrite)
    values = ",".join(f"{value:g}" for value in POSE)
    announce(f"3. Draw one: modrob assemble assemblies/{MAIN_ROBOT}.yaml --q {values} --picture png -o {out}/pose")
    main = next(path for path in paths if path.stem == MAIN_ROBOT)
    assemble([main], out / "pose", q=list(POSE), picture="png", overwrite=overwrite)
    with OutputFolder(out, overwrite) as folder:
        folder.write("README.md", _GUIDE.replace("{main}", MAIN_ROBOT))
    return DemoResult(checked, robots, out)
