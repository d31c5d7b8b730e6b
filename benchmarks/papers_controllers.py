"""Robust controllers of [R] V and [D] 3.5 on shipped documents: ``python -m benchmarks.papers_controllers``.

Each row is one run of ``modrob simulate``. Error: norm of desired minus true joint positions. Torque: norm of the
commands. Total variation: sum of the absolute changes of all commands per second, what chattering is. About five
minutes on one core; ``--pictures FOLDER`` draws what docs/papers.md shows.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.controllers_study import rms, study_of
from modrob_cli.arrays import Array
from modrob_cli.dynamics.exact_star import exact_bounds_star
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.newton_euler_star import rnea_star
from modrob_cli.model.scenario import BoundsMethod
from modrob_cli.plot.perturbation import PerturbationPicture, draw_perturbation
from modrob_cli.simulate.perturbation import violations
from modrob_cli.simulate.recording import Run
from modrob_cli.workflows.simulation_study import Study, published_links, run_one

PRECISION = 0.01
SETTLED = 1.0
"""Errors are judged from here on [s]; the arm starts beside the motion."""
STABILITY = [f"d-3-5-{k}-{name}" for k in (1, 2) for name in ("id", "cr", "ia-id")]
PERFORMANCE = [f"d-3-5-{k}-{name}" for k in (3, 4) for name in ("ia-pb", "r-alpha")]


@dataclass(frozen=True)
class Result:
    """One run: error norm and commands, shapes (K,) and (K, n)."""

    study: Study
    run: Run
    error: Array

    @property
    def reached(self) -> float | None:
        """Time from which on the error is below the precision; None if it is not at the end."""
        above = np.flatnonzero(self.error > PRECISION)
        t = self.run.recording.t
        return None if len(above) and above[-1] == len(t) - 1 else float(t[above[-1] + 1]) if len(above) else 0.0

    def cells(self) -> list[str]:
        """Largest and RMS error after the start, RMS torque, total variation, violations."""
        t, u = self.run.recording.t, self.run.recording.values["commanded"]
        if self.run.diverged is not None:
            return [f"ran away at {self.run.diverged:.3g} s", *["-"] * 4]
        late = t >= SETTLED
        torque = rms(np.linalg.norm(u[late], axis=1))
        variation = float(np.abs(np.diff(u[late], axis=0)).sum() / (t[-1] - SETTLED))
        values = self.run.recording.values
        outside = "-"
        if "perturbation" in values:
            counts, _ = violations(*(values[key] for key in ("perturbation", "phi_lower", "phi_upper")))
            outside = f"{counts.sum()} of {values['perturbation'].size}"
        worst, mean = 1e3 * float(self.error[late].max()), 1e3 * rms(self.error[late])
        return [f"{worst:.2f}", f"{mean:.2f}", f"{torque:.1f}", f"{variation:.3g}", outside]


def simulated(robot: str, motion: str, scenario: str, bounds: BoundsMethod = "exact") -> Result:
    """What ``modrob simulate --bounds`` does with these documents."""
    study = study_of(robot, motion, scenario)
    said = study.scenario.scenario
    changed = replace(said, control=replace(said.control, bounds=bounds))
    study = replace(study, scenario=replace(study.scenario, scenario=changed))
    run, _ = run_one(study, 0, lambda _: None)
    recording = run.recording
    return Result(study, run, np.linalg.norm(recording.desired[:, 0] - recording.values["q"], axis=1))


def print_published(scenario: str) -> Result:
    """[R] V: one scenario, with both kinds of bounds at the states of the run."""
    result = simulated("lwa4p-rtable1", "r-13", scenario)
    robot, values = result.study.robot.robot, result.run.recording.values
    states = auxiliary(result)
    exact = exact_bounds_star(robot, *states)
    q, dq, dq_a, ddq_a = states
    published = ianea(robot, q, dq, ddq_a, published_links(robot), dq_a)
    # each kind of bounds has its own factorisation of C, for the nominal torque and for the true one
    true = rnea_star(result.run.truth.robot, *states)
    outside = violations(true, published.lower, published.upper)[0].sum()
    own = violations(*(values[key] for key in ("perturbation", "phi_lower", "phi_upper")))[0].sum()
    reached = "never" if result.reached is None else f"{result.reached:.2f} s"
    print(f"\n`{scenario}`: error below 0.01 rad from {reached} on, at the end {1e3 * result.error[-1]:.2f} mrad")
    total = values["perturbation"].size
    print(f"true perturbation outside its bounds: exact {own} of {total}, IANEA {outside} of {true.size}\n")
    print("| joint | largest true perturbation | mean width, exact | IANEA | IANEA / exact |")
    print("|---|---|---|---|---|")
    wide, tight = ((b.upper - b.lower).mean(axis=0) for b in (published, exact))
    for j, name in enumerate(robot.joint_names):
        largest = np.abs(values["perturbation"][:, j]).max()
        print(f"| {name} | {largest:.2f} | {tight[j]:.3g} | {wide[j]:.3g} | {wide[j] / tight[j]:.2f} |", flush=True)
    return result


def auxiliary(result: Result, most: int = 20_000) -> tuple[Array, Array, Array, Array]:
    """q, dq, dq_a, ddq_a of the commands of ``ia-pb``, thinned, shape (K, n) each."""
    recording = result.run.recording
    step = max(len(recording.t) // most, 1)
    q, dq = (recording.values[key][::step] for key in ("q_measured", "dq_measured"))
    desired = recording.desired[::step]
    rate = np.asarray(result.study.scenario.scenario.control.gains["error"])
    return q, dq, desired[:, 1] + rate * (desired[:, 0] - q), desired[:, 2] + rate * (desired[:, 1] - dq)


def print_comparison(robot: str, scenarios: Sequence[str], bounds: BoundsMethod = "exact") -> list[Result]:
    """A table over controllers."""
    print(f"\n`{robot}`, bounds {bounds}\n")
    columns = ("largest error [mrad]", "RMS [mrad]", "RMS torque [N m]", "total variation [N m/s]", "outside [Phi]")
    print(f"| scenario | {' | '.join(columns)} |")
    print("|---|---|---|---|---|---|")
    results = []
    for scenario in scenarios:
        result = simulated(robot, "d-3-44", scenario, bounds)
        print(f"| `{scenario}` | {' | '.join(result.cells())} |", flush=True)
        results.append(result)
    return results


def print_reaching() -> None:
    """How long the growing gains of ``ia-pb`` need."""
    print("\n| bounds | largest error in periods 2, 6, 11, 16, 21, 25 [mrad] | below 10 mrad from | total variation |")
    print("|---|---|---|---|")
    kinds: tuple[BoundsMethod, ...] = ("exact", "ianea")
    for bounds in kinds:
        result = simulated("planar-2r-printed", "d-3-44-repeated", "d-3-5-4-ia-pb", bounds)
        each = [1e3 * float(result.error[4000 * k : 4000 * (k + 1)].max()) for k in (1, 5, 10, 15, 20, 24)]
        reached = "-" if result.reached is None else f"{result.reached:.1f} s"
        print(f"| {bounds} | {', '.join(f'{x:.2f}' for x in each)} | {reached} | {result.cells()[3]} |", flush=True)


def draw_comparison(path: Path, title: str, results: Sequence[Result]) -> None:
    """Errors and torques of several controllers, one row for each scenario of the paper."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 5.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    kinds = sorted({result.study.scenario.scenario.name.split("-")[3] for result in results})
    for row, kind in zip(axes, kinds, strict=True):
        for result in results:
            if result.study.scenario.scenario.name.split("-")[3] == kind:
                t, u = result.run.recording.t, result.run.recording.values["commanded"]
                label = result.study.controller
                row[0].plot(t, 1e3 * result.error, linewidth=0.9, label=label)
                order = 1 if label in ("cr", "r-alpha") else 2
                row[1].plot(t, np.linalg.norm(u, axis=1), linewidth=0.7, label=label, zorder=order)
        row[0].axhline(1e3 * PRECISION, color="#5f6368", linewidth=0.9, linestyle="--")
        row[0].set_title(f"scenario {kind}: norm of the error [mrad]", fontsize=9, loc="left")
        row[1].set_title(f"scenario {kind}: norm of the torque [N m]", fontsize=9, loc="left")
        for axis in row:
            axis.grid(alpha=0.3)
            axis.set_xlim(0.0, 4.0)
        row[0].set_ylim(0.0, 30.0)
        row[0].legend(fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel("t [s]")
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=80)


def draw_bounds(path: Path, result: Result) -> None:
    """As ``modrob simulate`` draws it, for fewer samples."""
    recording, robot = result.run.recording, result.study.robot.robot
    values, scenario = recording.values, result.study.scenario.scenario
    picture = PerturbationPicture(
        f"{robot.name}: {result.study.controller} on {result.study.motion.name}",
        f"scenario {scenario.name}; bounds of the perturbation: {scenario.control.bounds}",
        recording.t,
        result.error,
        np.linalg.norm(values["commanded"], axis=1),
        values["perturbation"],
        values["phi_lower"],
        values["phi_upper"],
        robot.joint_names,
        ("N m",) * robot.dof,
        PRECISION,
    )
    draw_perturbation(picture, path)


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path, help="folder for PNG files")
    folder = parser.parse_args().pictures
    published = [print_published(name) for name in ("r-v-1", "r-v-2")]
    stable = print_comparison("planar-2r-printed", STABILITY)
    print_comparison("planar-2r", STABILITY)
    print_comparison("planar-2r-printed", [STABILITY[2], STABILITY[5]], "ianea")
    exact = print_comparison("planar-2r-printed", PERFORMANCE)
    print_comparison("planar-2r-printed", [PERFORMANCE[0], PERFORMANCE[2]], "ianea")
    print_reaching()
    if folder is None:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for name, result in zip(("papers-r-1", "papers-r-2"), published, strict=True):
        draw_bounds(folder / f"{name}.png", result)
    draw_comparison(folder / "papers-d-stability.png", "Robust stability, [D] Figures 3.6 and 3.7", stable)
    draw_comparison(folder / "papers-d-performance.png", "Robust performance, [D] Figures 3.8 and 3.9", exact)
    draw_bounds(folder / "papers-d-bounds.png", exact[2])


if __name__ == "__main__":
    main()
