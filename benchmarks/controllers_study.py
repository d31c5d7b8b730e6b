"""Controllers on arms of growing complexity, after [D] 2.6.4: ``python -m benchmarks.controllers_study``.

Each row is one run of ``modrob simulate`` with documents of this repository. Error: norm of desired minus true joint
positions; RMS over the run, over its first and its last third, and the largest.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.body import RigidBody
from modrob_cli.model.scenario import Control
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.simulate.control_model import ControlModel
from modrob_cli.simulate.controllers.shipped import CONTROLLERS
from modrob_cli.simulate.recording import Run
from modrob_cli.workflows.simulation_study import SimulateOptions, Study, read_study, run_one

ROOT = Path(__file__).parents[1]

INSENSITIVE = [
    (robot, "half-b1-6", scenario)
    for robot in ("lwa4p-6", "lwa4p-6-compact", "lwa4p-6-printed", "lwa4p-6-extended", "lwa4p-6-tool")
    for scenario in ("id-35", "pb-42")
]
ARMS = (
    ("lwa4p-4", "half-b1-4"),
    ("lwa4p-6", "half-b1-6"),
    ("lwa4p-8", "half-b1-8"),
    ("lwa4p-8-tool", "half-b1-8"),
    ("lwa4p-6-tool", "half-b1-6"),
)
REBUILT = [(*arm, scenario) for arm in ARMS for scenario in ("pid-50", "id-50", "pb-afc-50")]
LOADED = [("pid-50", None), ("id-50", None), ("id-50", 12500.0), ("pb-afc-50", None), ("pb-afc-50", 500.0)]
LEARNING = [("lwa4p-6", "fourier-6-repeated", "pb-afc-zero-guess")]
DELAYS = (0, 2, 5, 10, 15, 20, 30)
ROBUST = ("ia-id", "ia-pb", "cr", "r-alpha")
"""Controllers of benchmarks.papers_controllers."""
PERIOD = 10.0
"""Period of the motion that is repeated [s]."""


@dataclass(frozen=True)
class Row:
    """One run: times (K,) and norm of the error (K,) at each sample."""

    robot: str
    scenario: str
    t: Array
    error: Array
    run: Run

    def cells(self) -> list[str]:
        """RMS, that of the first and the last third, largest [mrad], commands that were cut, end."""
        parts = np.array_split(self.error, 3)
        sizes = [rms(self.error), rms(parts[0]), rms(parts[-1]), float(self.error.max())]
        end = "-" if self.run.diverged is None else f"{self.run.diverged:.3g} s"
        return [*(f"{1e3 * size:.2f}" for size in sizes), f"{self.run.saturated.max():.1%}", end]


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def simulated(robot: str, motion: str, scenario: str) -> Row:
    """What ``modrob simulate`` does with these documents."""
    return one_row(study_of(robot, motion, scenario))


def study_of(robot: str, motion: str, scenario: str) -> Study:
    """Documents of this repository, read."""
    folders = {"assemblies": robot, "trajectories": motion, "scenarios": scenario}
    paths = [ROOT / folder / f"{name}.yaml" for folder, name in folders.items()]
    return read_study(paths[0], paths[1], SimulateOptions(scenario=paths[2]))


def one_row(study: Study) -> Row:
    """Run it."""
    run, _ = run_one(study, 0, lambda _: None)
    recording = run.recording
    error = np.linalg.norm(recording.desired[:, 0] - recording.values["q"], axis=1)
    return Row(study.robot.robot.name, study.scenario.scenario.name, recording.t, error, run)


def loaded(robot: str, motion: str, scenario: str, integral: float | None) -> Row:
    """The same with 2 kg at the end effector that the controller does not know of, and another integral gain."""
    study = study_of(robot, motion, scenario)
    tensor = 0.006 * np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])
    mass, com, inertia = (Uncertain.exact(value) for value in (2.0, np.array([0.0, 0.0, 0.1]), tensor))
    payload = RigidBody("unknown", mass, com, inertia)
    said = study.scenario.scenario
    gains = said.control.gains if integral is None else {**said.control.gains, "integral": integral}
    name = said.name if integral is None else f"{said.name}, integral {integral:g}"
    changed = replace(said, name=name, payload=payload, control=replace(said.control, gains=gains))
    return one_row(replace(study, scenario=replace(study.scenario, scenario=changed)))


def pid_poles(robot: str, motion: str) -> tuple[float, float]:
    """Largest eigenvalue of M over the rotors' inertia along the motion, and largest real part of the poles of ``pid``.

    The poles are those of M s^3 + (b + K_D) s^2 + K_P s + K_I with M(q) at rest, without delay and sampling.
    """
    study = study_of(robot, motion, "pid-50")
    model, trajectory = ControlModel(study.robot.robot), study.motion.trajectory
    J, b, n, w, z = model.armature, model.viscous, model.dof, 50.0, 0.65
    stiffness = [np.diag(x) for x in (w**2 * b, w**2 * J + 2 * z * w * b, b + 2 * z * w * J)]
    ratio, worst = 0.0, -np.inf
    for q in trajectory.sample(np.linspace(0.0, trajectory.duration, 200), 0)[:, 0]:
        M = model.inertia(q)
        ratio = max(ratio, float(np.linalg.eigvalsh(M / np.sqrt(np.outer(J, J)))[-1]))
        A = np.eye(3 * n, k=n)
        A[2 * n :] = -np.linalg.solve(M, np.hstack(stiffness))
        worst = max(worst, float(np.linalg.eigvals(A).real.max()))
    return ratio, worst


def print_poles() -> None:
    """Why the decentralised controller fails."""
    print("\n| arm | inertia over that of the rotors, up to | pole of `pid` farthest to the right, up to [1/s] |")
    print("|---|---|---|")
    for robot, motion in ARMS:
        ratio, worst = pid_poles(robot, motion)
        print(f"| `{robot}` | {ratio:.1f} | {worst:+.1f} |")


def print_table(title: str, cases: Sequence[Callable[[], Row]]) -> list[Row]:
    """Run the cases, print a table of Markdown."""
    print(f"\n{title}\n")
    print("| arm | scenario | RMS [mrad] | first third | last third | largest | commands cut | ran away |")
    print("|---|---|---|---|---|---|---|---|")
    rows = []
    for case in cases:
        row = case()
        print(f"| `{row.robot}` | `{row.scenario}` | {' | '.join(row.cells())} |", flush=True)
        rows.append(row)
    return rows


def print_delays() -> None:
    """Largest error with default gains against the delay of the sensors; bold where torque limits are reached."""
    print("\n| controller | " + " | ".join(f"{delay} ms" for delay in DELAYS) + " |")
    print("|---|" + "---|" * len(DELAYS))
    study = study_of("lwa4p-6", "half-b1-6", "id-50")
    said = study.scenario.scenario
    for name in (name for name in CONTROLLERS if name not in ROBUST):
        cells = []
        for delay in DELAYS:
            sensors = replace(said.sensors, delay=1e-3 * delay)
            scenario = replace(study.scenario, scenario=replace(said, sensors=sensors, control=Control(name)))
            row = one_row(replace(study, controller=name, scenario=scenario))
            mark = "**" if row.run.saturated.any() else ""
            cells.append(f"{mark}{1e3 * row.error.max():.1f}{mark}")
        print(f"| `{name}` | " + " | ".join(cells) + " |", flush=True)


def print_repetitions(row: Row) -> None:
    """RMS error of each repetition of the motion."""
    count = round(row.t[-1] / PERIOD)
    of = np.minimum((row.t / PERIOD).astype(int), count - 1)
    print("\n| repetition | " + " | ".join(str(k + 1) for k in range(count)) + " |")
    print("|---|" + "---|" * count)
    for name, size in (("RMS [mrad]", rms), ("largest [mrad]", np.max)):
        print(f"| {name} | " + " | ".join(f"{1e3 * size(row.error[of == k]):.2f}" for k in range(count)) + " |")


def draw(path: Path, title: str, rows: Sequence[Row], rows_of: Sequence[str]) -> None:
    """Error over time, one axes for each robot."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 1.7 * len(rows_of) + 0.7), layout="constrained")
    for axes, robot in zip(np.ravel(figure.subplots(len(rows_of), sharex=True)), rows_of, strict=True):
        for row in (row for row in rows if row.robot == robot):
            axes.plot(row.t, 1e3 * row.error, linewidth=0.8, label=row.scenario)
        axes.set_title(robot, fontsize=9, loc="left")
        axes.set_ylabel("error [mrad]", fontsize=8)
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.3)
    figure.legend(*axes.get_legend_handles_labels(), fontsize=8, ncols=3, loc="outside lower center")
    axes.set_xlabel("t [s]")
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=80)


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path, help="folder for PNG files of the errors over time")
    folder = parser.parse_args().pictures
    same = print_table("One controller, several arms", [partial(simulated, *case) for case in INSENSITIVE])
    rebuilt = print_table("Rebuilt without tuning", [partial(simulated, *case) for case in REBUILT])
    print_poles()
    unknown = [partial(loaded, "lwa4p-6", "half-b1-6", *case) for case in LOADED]
    print_table("With 2 kg of which no controller knows", unknown)
    learned = print_table("Friction learned from nothing", [partial(simulated, *case) for case in LEARNING])
    print_repetitions(learned[0])
    print_delays()
    if folder is None:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for name, title, rows in (
        ("controllers-arms", "Norm of the position error, gains unchanged", same),
        ("controllers-rebuilt", "Norm of the position error, no tuning after rebuilding", rebuilt),
        ("controllers-learning", "Norm of the position error, friction learned from nothing", learned),
    ):
        draw(folder / f"{name}.png", title, rows, list(dict.fromkeys(row.robot for row in rows)))


if __name__ == "__main__":
    main()
