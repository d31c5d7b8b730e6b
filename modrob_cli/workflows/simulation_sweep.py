"""Many simulated runs, each with a robot drawn from the box of admissible parameters."""

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.io.outputs import OutputFolder
from modrob_cli.plot.simulation import SweepPicture, draw_sweep
from modrob_cli.workflows.simulation_log import write_log
from modrob_cli.workflows.simulation_study import Study, header, log_notes, run_one, study_provenance
from modrob_cli.workflows.simulation_summary import run_summary

Progress = Callable[[str, float], None]


def sweep(study: Study, runs: int, folder: OutputFolder, log: Path, progress: Progress) -> dict[str, Any]:
    """Simulate ``runs`` drawn robots; a log each, one table, one summary, one picture.

    Raises
    ------
    OutputExistsError
        If a file is there already and may not be replaced; before the work.
    """
    digits = len(str(runs))
    logs = [f"{log.stem}-{k:0{digits}d}.mcap" for k in range(1, runs + 1)]
    names = {kind: f"{log.stem}.sweep.{kind}" for kind in ("json", "csv", "png")}
    folder.claim([*logs, *names.values()])
    robot, scenario = study.robot.robot, study.scenario.scenario
    entries, norms, times = [], [], []
    for k, name in enumerate(logs, start=1):
        run, _ = run_one(study, k, lambda done, k=k: progress(f"Simulating {k} of {runs}", (k - 1 + done) / runs))  # type: ignore[misc]
        write_log(robot, run, scenario, log_notes(study, run), folder.stage(name))
        entries.append({"log": str(log.parent / name), "run": k, **run_summary(robot, run, scenario)})
        error = run.recording.values["q"] - run.recording.desired[:, 0]
        norms.append(np.linalg.norm(error, axis=1))
        times.append(run.recording.t)
    result = {**header(study), "runs": entries, "provenance": study_provenance(study)}
    folder.write(names["json"], json.dumps(result, indent=2, allow_nan=False) + "\n")
    folder.write(names["csv"], _table(entries))
    title = f"{robot.name}: {study.controller} on {study.motion.name}, {runs} robots drawn from the box"
    draw_sweep(SweepPicture(title, tuple(times), tuple(norms)), folder.stage(names["png"]))
    return {**result, "files": {kind: str(log.parent / name) for kind, name in names.items()}}


def _table(entries: list[dict[str, Any]]) -> str:
    """One line for each run: errors of each joint, and what was drawn of the joints and bodies."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    joints = [joint["name"] for joint in entries[0]["joints"]]
    keys = ("viscous", "coulomb", "rotor_inertia", "offset")
    bodies = [body["name"] for body in entries[0]["truth"]["bodies"]]
    columns = ["log", "diverged", "rms_error", "max_error"]
    columns += [f"{name}.{key}" for name in joints for key in ("rms_error", "max_error", "saturated", *keys)]
    writer.writerow([*columns, *(f"{name}.mass" for name in bodies)])
    for entry in entries:
        row = [Path(entry["log"]).name, entry["diverged"], entry["error_norm"]["rms"], entry["error_norm"]["max"]]
        for joint, true in zip(entry["joints"], entry["truth"]["joints"], strict=True):
            row += [joint["rms_error"], joint["max_error"], joint["saturated"], *(true[key] for key in keys)]
        writer.writerow([*row, *(body["mass"] for body in entry["truth"]["bodies"])])
    return out.getvalue()
