"""The published rule for scaling motions against a simulated arm: the picture of docs/scale.md.

    python -m benchmarks.scale_published_rule docs/pictures/scale-published-rule.png

An arm whose parameters are known raises a load; the rule's factor and the proven one are simulated.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from modrob_cli.arrays import Array
from modrob_cli.dynamics.drive_torque import torque_limits
from modrob_cli.workflows.robots import load_robot
from modrob_cli.workflows.scale import find
from modrob_cli.workflows.scale_problem import ScaleOptions, read_problem
from modrob_cli.workflows.scale_trajectory import scaled_motion
from modrob_cli.workflows.simulation_study import SimulateOptions, read_study, run_one

ROOT = Path(__file__).parents[1]
ROBOT, MOTION = ROOT / "assemblies" / "lwa4p-3kg.yaml", ROOT / "trajectories" / "lift-folded.yaml"
JOINT = 1


def simulated(factor: float) -> tuple[Array, Array, Array]:
    """Times (T,), commanded torque of the joint and its position error (T,) at a factor."""
    problem = read_problem(ROBOT, MOTION, ScaleOptions())
    with tempfile.TemporaryDirectory() as folder:
        name, text = scaled_motion(problem.loaded, factor, 1000.0)
        path = Path(folder) / name
        path.write_text(text, encoding="utf-8")
        study = read_study(ROBOT, path, SimulateOptions(controller="id"))
        run, _ = run_one(study, 0, lambda done: None)
    recording = run.recording
    error = recording.values["q"][:, JOINT] - recording.desired[:, 0, JOINT]
    return recording.t, recording.values["commanded"][:, JOINT], error


def main() -> None:
    """Simulate both factors and draw."""
    answer = find(read_problem(ROBOT, MOTION, ScaleOptions(certify=True)))
    rule, proven = answer.compared["published_rule"], answer.used
    assert rule is not None
    assert proven is not None
    low, high = (float(end[JOINT]) for end in torque_limits(load_robot(ROBOT).robot))
    figure = Figure(figsize=(10.0, 5.0), dpi=110)
    FigureCanvasAgg(figure)
    axes: Any = figure.subplots(2, 2, sharey="row", sharex="col")
    for column, (factor, words) in enumerate(((rule, "published rule"), (proven, "proven"))):
        t, torque, error = simulated(factor)
        top, bottom = axes[0, column], axes[1, column]
        top.plot(t, torque, color="#0b57d0", linewidth=1.2)
        top.fill_between(t, torque, low, where=torque < low, color="#e8453c", linewidth=0.8)
        for limit in (low, high):
            top.axhline(limit, color="#b3261e", linewidth=1.1, linestyle=(0, (5, 3)))
        bottom.plot(t, np.degrees(error), color="#0b57d0", linewidth=1.2)
        beyond = float(np.mean((torque < low) | (torque > high)))
        top.set_title(f"{words}: factor {factor:.3f}, above 8 A {beyond:.0%} of the time", fontsize=9, loc="left")
        bottom.set_xlabel("time [s]")
        print(
            f"{words}: factor {factor:.4f}, beyond {beyond:.1%}, error up to {np.degrees(np.abs(error).max()):.3g} deg"
        )
    axes[0, 0].set_ylabel("commanded torque\nof joint 2 [N m]")
    axes[0, 0].set_ylim(1.5 * low, 10.0)
    axes[1, 0].set_ylabel("position error\nof joint 2 [deg]")
    for axis in axes.flat:
        axis.grid(True, color="#e3e3e3", linewidth=0.6)
        axis.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(sys.argv[1], metadata={"Software": None})


if __name__ == "__main__":
    main()
