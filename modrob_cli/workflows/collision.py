"""Collision thresholds along logs and planned motions: bands, events, sensitivity, tables for controllers."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.identify.effort import effort_factors
from modrob_cli.io.mcap_writer import Series, write_mcap
from modrob_cli.io.number_csv import NumberCsv
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.io.ros_messages import joint_state
from modrob_cli.io.yaml_writer import yaml_text
from modrob_cli.model.robot import Robot
from modrob_cli.plot.collision import draw_collision
from modrob_cli.report.render import render
from modrob_cli.workflows.collision_judge import JudgedRun, Learned, judge_run, learn
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_report import collision_picture, collision_report
from modrob_cli.workflows.collision_result import SCOPE, events_csv, learned_json, log_result, threshold_document
from modrob_cli.workflows.collision_runs import CollisionRun, load_run
from modrob_cli.workflows.identify_runs import Tracker, unique_stems
from modrob_cli.workflows.robots import load_robot

MOST_ROWS = 20_000
"""Rows of the CSV of a log: of a longer one every k-th sample and all events; the MCAP file has all samples."""
TOPICS = ("/collision/measured", "/collision/lower", "/collision/upper")

_PER_LOG = ("json", "png", "csv", "mcap")


def collision(
    robot_path: Path,
    motions: Sequence[Path],
    options: CollisionOptions,
    out: Path,
    overwrite: bool = False,
    track: Tracker = iter,
) -> dict[str, Any]:
    """Make thresholds along motions and look where measured torques leave them.

    Parameters
    ----------
    motions : logs (MCAP, CSV) or planned motions (YAML, JSON)
    track : wraps the list of motions, to show progress

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/collision.md``

    Raises
    ------
    InputFileError
        With the faults of all files; nothing is written then.
    UsageError
        If options, robot and motions do not fit together.
    NumericalError
        If a band is not finite, or a filter does not fit a log.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    loaded = load_robot(robot_path)
    robot = loaded.robot
    options.check(robot)
    common = {
        "report": f"{robot.name}.collision.html",
        "events": f"{robot.name}.collision.events.csv",
        "thresholds": f"{robot.name}.collision.thresholds.yaml",
    }
    stems = unique_stems(motions)
    with OutputFolder(out, overwrite) as folder:
        folder.claim([f"{stem}.collision.{kind}" for stem in stems for kind in _PER_LOG])
        folder.claim(list(common.values()))
        learned = learn(_load(robot, options.train, unique_stems(options.train), options, iter), options)
        runs = _load(robot, motions, stems, options, track)
        judged = [judge_run(run, options, learned) for run in runs]
        results = [log_result(one, options) for one in judged]
        head = _head(robot, results, learned, options)
        inputs = [*loaded.files, *motions, *options.train, *([options.desired] if options.desired else [])]
        made_from = provenance(inputs)
        for one, result in zip(judged, results, strict=True):
            _write_log(folder, one, {**head, "logs": [result], "provenance": made_from}, options)
        document = threshold_document(robot, judged, options)
        folder.write(common["thresholds"], yaml_text(document))
        folder.write(common["events"], events_csv(results))
        page = collision_report(robot, judged, results, head, document, options, made_from)
        folder.write(common["report"], render(page))
    names = [f"{stem}.collision.{kind}" for stem in stems for kind in _PER_LOG]
    files = {kind: str(out / name) for kind, name in common.items()} | {name: str(out / name) for name in names}
    return {**head, "logs": results, "thresholds": document, "provenance": made_from, "files": files}


def _load(
    robot: Robot, paths: Sequence[Path], names: Sequence[str], options: CollisionOptions, track: Tracker
) -> list[CollisionRun]:
    """All files, or the faults of all of them."""
    runs: list[CollisionRun] = []
    faults: list[Fault] = []
    by_path = iter(names)
    for path in track(paths):
        try:
            runs.append(load_run(robot, path, next(by_path), options))
        except InputFileError as error:
            faults.extend(error.faults)
    if faults:
        raise InputFileError(faults)
    return runs


def _head(
    robot: Robot, results: Sequence[dict[str, Any]], learned: Learned | None, options: CollisionOptions
) -> dict[str, Any]:
    measured = [result for result in results if not result["planned"]]
    if options.train and not measured:
        raise UsageError("--train is for logs; there are only planned motions")
    found = any(result["events"] for result in measured)
    return {
        "robot": robot.name,
        "collision": found if measured else None,
        "scope": SCOPE,
        "options": options.data,
        "learned": learned_json(robot, learned, options),
    }


def _write_log(folder: OutputFolder, judged: JudgedRun, result: dict[str, Any], options: CollisionOptions) -> None:
    stem = f"{judged.run.name}.collision"
    folder.write(f"{stem}.json", json.dumps(result, indent=2, allow_nan=False) + "\n")
    draw_collision(collision_picture(judged, options), folder.stage(f"{stem}.png"))
    _write_csv(judged, options, folder.stage(f"{stem}.csv"))
    _write_mcap(judged, options, folder.stage(f"{stem}.mcap"))


def _write_csv(judged: JudgedRun, options: CollisionOptions, path: Path) -> None:
    """Filtered measurement and band in the unit of the log."""
    run, band = judged.run, judged.band
    factors = effort_factors(run.robot, options.effort)
    kinds = ("measured", "lower", "upper") if run.tau is not None else ("lower", "upper")
    step = -(-len(run.motion.t) // MOST_ROWS)
    keep = np.arange(len(run.motion.t)) % step == 0
    if judged.methods:
        keep |= (judged.methods[0].excess != 0.0).any(axis=1)
    series = np.stack([getattr(band, kind)[keep] / factors for kind in kinds], axis=-1)
    with NumberCsv(
        path, ["t", "used", *(f"{name}.{kind}" for name in run.robot.joint_names for kind in kinds)]
    ) as table:
        table.write(np.column_stack([run.motion.t[keep], run.used[keep], series.reshape(len(series), -1)]))


def _write_mcap(judged: JudgedRun, options: CollisionOptions, path: Path) -> None:
    """The same as joint states with efforts, at the times of the log, for PlotJuggler and Foxglove."""
    run, band = judged.run, judged.band
    factors = effort_factors(run.robot, options.effort)
    layout = joint_state(run.robot.joint_names, position=False, velocity=False)
    stamps = run.start + np.round(run.motion.t * 1e9).astype(np.int64)
    parts = (None if run.tau is None else band.measured, band.lower, band.upper)
    series = [
        Series(topic, layout, stamps, values / factors)
        for topic, values in zip(TOPICS, parts, strict=True)
        if values is not None
    ]
    write_mcap(path, series)
