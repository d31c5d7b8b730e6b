"""``modrob demo``: the whole chain on the shipped example."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from modrob_cli.io.catalogue import yaml_files
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.shipped import SHIPPED_FOLDERS, shipped_folder
from modrob_cli.workflows.assemble import AssembledRobot, assemble
from modrob_cli.workflows.bounds import bounds
from modrob_cli.workflows.bounds_method import BoundsOptions
from modrob_cli.workflows.check import CheckResult, check
from modrob_cli.workflows.collision import collision
from modrob_cli.workflows.collision_options import CollisionOptions, parse_filter
from modrob_cli.workflows.identify import identify
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.scale import scale
from modrob_cli.workflows.scale_problem import ScaleOptions
from modrob_cli.workflows.simulate import simulate
from modrob_cli.workflows.simulation_study import SimulateOptions
from modrob_cli.workflows.trajectory import trajectory
from modrob_cli.workflows.validate import validate
from modrob_cli.workflows.validate_options import ValidateOptions

MAIN_ROBOT = "lwa4p-6"
UNCERTAIN_ROBOT = "lwa4p-6-tol5"
PAYLOAD_ROBOT = "lwa4p-table34"
MOTION = "table-b1"
OTHER_MOTION = "half-b1-6"
SCENARIO = "payload"
TRUE_SCENARIO = "box"
SCALED_MOTION = "s-iv-a"
CURRENT_LIMITS = (8.0, 8.0, 8.0, 8.0, 2.0, 2.0)
COLLISION_ROBOT = "lwa4p-table34-friction"
COLLISION_SCENARIOS = ("no-contact", "hit-and-push")
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
| `motion/{motion}.png` | the motion: position, velocity, acceleration, and the limits of the arm |
| `motion/{motion}.csv`, `motion/{motion}.mcap` | its samples |
| `simulated/train.mcap`, `simulated/test.mcap` | runs of an arm whose parameters differ from its file by up to 5 % |
| `identified/{uncertain}.identify.html` | report: friction and rotors from the first run, and how sure that is |
| `identified/{uncertain}.identified.robot.yaml` | the arm with what was identified; every command reads it |
| `identified/{uncertain}.validate.html` | report: the identified arm against the second run, another motion |
| `scaled/{scaled}.scale.html` | report: how fast a motion may be run for every payload that the file admits |
| `scaled/{scaled}.certificate.json` | the proof; `modrob scale --verify` checks it |
| `collision/{collision}.collision.html` | report: a run without contact, one with a hit and a push |
| `simulated/payload.mcap` | a simulated run with 2 kg that the controller does not know of; PlotJuggler opens it |
| `simulated/payload.simulate.png` | how well the arm followed, and the motor torques |
| `validated/{main}.validate.html` | report: recorded torque against that of the model without the 2 kg |

The inputs are the shipped `modules/`, `assemblies/`, `trajectories/` and `scenarios/`;
`modrob init DIR` copies them into a workspace of your own.
"""


@dataclass(frozen=True)
class DemoResult:
    """What the demo did."""

    checked: CheckResult
    robots: list[AssembledRobot]
    bounds: dict[str, Any]
    simulated: dict[str, Any]
    validated: dict[str, Any]
    identified: dict[str, Any]
    held_out: dict[str, Any]
    scaled: dict[str, Any]
    collision: dict[str, Any]
    folder: Path

    def robot(self, name: str) -> AssembledRobot:
        """One of the robots by name."""
        return next(robot for robot in self.robots if robot.tables.robot.name == name)


def demo(out: Path, overwrite: bool, announce: Callable[[str], None]) -> DemoResult:
    """Check the shipped documents, assemble the arms, draw one, bound torques, simulate, validate, identify.

    ``announce`` is told each step.

    Raises
    ------
    OutputExistsError
        If files are there and ``overwrite`` is false.
    """
    modules, assemblies, trajectories, scenarios = (shipped_folder(name) for name in SHIPPED_FOLDERS)
    announce(f"1. Check the shipped catalogue: modrob check {' '.join(SHIPPED_FOLDERS)}")
    checked = check([modules, assemblies, trajectories, scenarios])
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
    simulated, validated = _simulate_and_validate(main, motion, out, overwrite, announce)
    uncertain = next(path for path in paths if path.stem == UNCERTAIN_ROBOT)
    identified, held_out = _identify_and_validate(uncertain, trajectories, out, overwrite, announce)
    scaled = _scale(payload, trajectories, out, overwrite, announce)
    found_contacts = _detect(assemblies, motion, out, overwrite, announce)
    guide = _GUIDE.replace("{main}", MAIN_ROBOT).replace("{uncertain}", UNCERTAIN_ROBOT).replace("{motion}", MOTION)
    guide = guide.replace("{scaled}", SCALED_MOTION).replace("{collision}", COLLISION_ROBOT)
    with OutputFolder(out, overwrite) as folder:
        folder.write("README.md", guide)
    results = (simulated, validated, identified, held_out, scaled, found_contacts)
    return DemoResult(checked, robots, found, *results, out)


def _simulate_and_validate(
    robot: Path, motion: Path, out: Path, overwrite: bool, announce: Callable[[str], None]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Sample the motion, let the arm follow it with a payload, compare the log with the model."""
    announce(f"5. Sample the motion: modrob trajectory {motion.name} --robot {robot.name} -o {out}/motion")
    trajectory(motion, robot, out / "motion", overwrite=overwrite)
    scenario, log = shipped_folder("scenarios") / f"{SCENARIO}.yaml", out / "simulated" / f"{SCENARIO}.mcap"
    files = f"{robot.name} {motion.name} --scenario {scenario.name}"
    announce(f"6. Simulate it with a payload: modrob simulate {files} -o {log}")
    simulated = simulate(robot, motion, SimulateOptions(scenario=scenario), log, overwrite)
    announce(f"7. Validate the model with the log: modrob validate {robot.name} {log} --effort torque")
    validated = validate(robot, [log], ValidateOptions("torque"), out / "validated", overwrite)
    return simulated, validated


def _identify_and_validate(
    robot: Path, trajectories: Path, out: Path, overwrite: bool, announce: Callable[[str], None]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Two runs of an arm that is not quite what its file says: identify from one, validate with the other."""
    scenario = shipped_folder("scenarios") / f"{TRUE_SCENARIO}.yaml"
    options = SimulateOptions(scenario=scenario)
    logs = {name: out / "simulated" / f"{name}.mcap" for name in ("train", "test")}
    announce(
        f"8. Two runs of an arm at the edge of its box: modrob simulate {robot.name} ... --scenario {scenario.name}"
    )
    for name, motion in (("train", MOTION), ("test", OTHER_MOTION)):
        simulate(robot, trajectories / f"{motion}.yaml", options, logs[name], overwrite)
    announce(f"9. Identify from one of them: modrob identify {robot.name} {logs['train']} --effort torque")
    identified = identify(robot, [logs["train"]], IdentifyOptions("torque"), out / "identified", overwrite)
    updated = Path(identified["files"]["robot"])
    announce(f"10. Validate with the other: modrob validate {updated} {logs['test']} --effort torque --max-nrmse 0.3")
    judging = ValidateOptions("torque", max_nrmse=0.3)
    return identified, validate(updated, [logs["test"]], judging, out / "identified", overwrite)


def _scale(
    robot: Path, trajectories: Path, out: Path, overwrite: bool, announce: Callable[[str], None]
) -> dict[str, Any]:
    """The largest factor that is safe for every payload, proven between the samples too."""
    motion = trajectories / f"{SCALED_MOTION}.yaml"
    currents = ",".join(f"{limit:g}" for limit in CURRENT_LIMITS)
    announce(f"11. Run a motion as fast as is safe: modrob scale {robot.name} {motion.name} --certify")
    announce(f"    --current-limits {currents} --velocity-limits none --acceleration-limits none -o {out}/scaled")
    current = tuple((-limit, limit) for limit in CURRENT_LIMITS)
    limits = (("current", current), ("velocity", (None,)), ("acceleration", (None,)))
    return scale(robot, motion, ScaleOptions(certify=True, limits=limits), out / "scaled", overwrite)


def _detect(
    assemblies: Path, motion: Path, out: Path, overwrite: bool, announce: Callable[[str], None]
) -> dict[str, Any]:
    """Two simulated runs of an arm that is known to its intervals only: without contact, and with a hit and a push."""
    robot = assemblies / f"{COLLISION_ROBOT}.yaml"
    announce(f"12. Two runs, one of them with contacts: modrob simulate {robot.name} {motion.name} --scenario ...")
    logs = []
    for name in COLLISION_SCENARIOS:
        logs.append(out / "simulated" / f"{name}.mcap")
        options = SimulateOptions(scenario=shipped_folder("scenarios") / f"{name}.yaml")
        simulate(robot, motion, options, logs[-1], overwrite)
    announce(f"13. Find the contacts: modrob collision {robot.name} {logs[0].name} {logs[1].name} --effort current")
    announce("    --ddq-tolerance 1 --q-noise 2e-6 --dq-noise 1e-4 --effort-noise 0.05 --filter butterworth2:10")
    return collision(robot, logs, collision_options(), out / "collision", overwrite)


def collision_options() -> CollisionOptions:
    """What the scenarios say of the sensors, and how far the acceleration may be from the desired one."""
    noise: dict[str, Any] = {"q_noise": [2e-6], "dq_noise": [1e-4], "effort_noise": [0.05]}
    return CollisionOptions("current", filter=parse_filter("butterworth2:10"), ddq_tolerance=[1.0], **noise)
