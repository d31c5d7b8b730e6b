"""The largest factor by which a motion may be sped up, for every admissible parameter."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.errors import NumericalError
from modrob_cli.io.certificate import certificate_text
from modrob_cli.io.outputs import OutputFolder, provenance
from modrob_cli.plot.scale import draw_factors, draw_torques
from modrob_cli.report.render import render
from modrob_cli.scaling.certify import Proof, certify
from modrob_cli.scaling.sampled import SampledFactors, States, gaps, sampled_factors
from modrob_cli.scaling.speed_limits import SpeedLimit, speed_limits
from modrob_cli.scaling.split_torque import SplitTorques, published_factor
from modrob_cli.workflows.scale_certificate import certificate_data
from modrob_cli.workflows.scale_pictures import ScaleViews, views
from modrob_cli.workflows.scale_problem import (
    METHODS,
    Method,
    ScaleOptions,
    ScaleProblem,
    motion_warnings,
    published_links,
    ranges_by,
    read_problem,
    sample_times,
)
from modrob_cli.workflows.scale_report import scale_report
from modrob_cli.workflows.scale_trajectory import scaled_motion
from modrob_cli.workflows.scale_words import critical_data, infeasible

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Answer:
    """What was found, before it is written down.

    Attributes
    ----------
    used : the factor of the scaled motion: the proven one, if a proof was asked for; None if no factor is safe
    compared : largest factor by method, and that of the published rule
    """

    problem: ScaleProblem
    samples: int
    sampled: SampledFactors
    proof: Proof | None
    used: float | None
    compared: dict[str, float | None]


def scale(
    robot_path: Path,
    motion_path: Path,
    options: ScaleOptions,
    out: Path,
    overwrite: bool = False,
    progress: Progress = lambda _what, _done: None,
    topic: str | None = None,
) -> dict[str, Any]:
    """Find the largest safe factor; write the scaled motion, pictures, report, and a certificate if asked for.

    Parameters
    ----------
    progress : told what is done and which part of it
    topic : where the motion is in an MCAP file

    Returns
    -------
    result : plain data for JSON, as documented in ``docs/scale.md``

    Raises
    ------
    InputFileError
        If a file cannot be used, limits are missing or make no sense, or the joints do not match.
    UsageError
        If options make no sense.
    NumericalError
        If the motion has values beyond the range of numbers.
    OutputExistsError
        If a file is there already and ``overwrite`` is false.
    """
    problem = read_problem(robot_path, motion_path, options, topic)
    with OutputFolder(out, overwrite) as folder:
        stem = problem.loaded.name
        names = {"report": f"{stem}.scale.html", "json": f"{stem}.scale.json"}
        names |= {"torques": f"{stem}.scale.png", "factors": f"{stem}.factors.png"}
        folder.claim(list(names.values()))
        answer = find(problem, progress)
        texts: dict[str, str] = {}
        if answer.used is not None:
            names["trajectory"], texts["trajectory"] = scaled_motion(problem.loaded, answer.used, options.rate)
        if answer.proof is not None and answer.proof.factor is not None:
            names["certificate"] = f"{stem}.certificate.json"
            data = certificate_data(problem, (robot_path, motion_path), topic, answer.sampled, answer.proof, out)
            texts["certificate"] = certificate_text(data)
        result = {**result_data(answer), "provenance": provenance(problem.files)}
        shown = views(problem, answer.sampled, answer.used)
        texts["report"] = render(scale_report(problem, result, shown))
        texts["json"] = json.dumps(result, indent=2, allow_nan=False) + "\n"
        _draw(shown, answer, folder, names)
        for kind, text in texts.items():
            folder.write(names[kind], text)
    return {**result, "files": {kind: str(out / name) for kind, name in names.items()}}


def _draw(shown: ScaleViews, answer: Answer, folder: OutputFolder, names: dict[str, str]) -> None:
    draw_torques(shown.torques, folder.stage(names["torques"]))
    title = f"{answer.problem.robot.name}: safe factors along {answer.problem.loaded.name}"
    draw_factors(shown.factors, answer.used, title, folder.stage(names["factors"]))


def find(problem: ScaleProblem, progress: Progress = lambda _what, _done: None) -> Answer:
    """Find the factors that are safe at the samples and, if asked for, prove one.

    Raises
    ------
    NumericalError
        If the motion has values beyond the range of numbers.
    """
    options = problem.options
    with np.errstate(all="ignore"):  # of absurd sizes; what is not finite is refused
        states = States.of(problem.trajectory, sample_times(problem))
        if not all(np.isfinite(part).all() for part in (states.q, states.dq, states.ddq)):
            raise NumericalError("the motion has values beyond the range of numbers; look at its sizes and times")
        speeds = speed_limits(problem.trajectory, problem.robot)
    progress("Scaling", 0.0)
    sampled = _sampled(problem, states, speeds, options.method)
    compared: dict[str, float | None] = {options.method: sampled.factor}
    for method in METHODS:
        if method not in compared:
            compared[method] = _sampled(problem, states, speeds, method).factor
        progress("Scaling", len(compared) / 3.0)
    compared["published_rule"] = _published(problem, states, speeds)
    proof, used = None, sampled.factor
    if options.certify and sampled.factor is not None:
        span = (options.min_factor, sampled.factor)
        proof = certify(
            problem.robot, problem.trajectory, problem.limits, span, options.gap, lambda done: progress("Proving", done)
        )
        used = proof.factor
    return Answer(problem, len(states.t), sampled, proof, used, compared)


def _sampled(problem: ScaleProblem, states: States, speeds: list[SpeedLimit], method: Method) -> SampledFactors:
    span = (problem.options.min_factor, problem.options.max_factor)
    return sampled_factors(ranges_by(problem.robot, method), states, problem.limits, speeds, span)


def _published(problem: ScaleProblem, states: States, speeds: list[SpeedLimit]) -> float | None:
    """Factor of the published rule, with the other limits of the motion; None where its condition at c = 0 fails."""
    links = published_links(problem.robot)
    slowest = min((limit.factor for limit in speeds), default=np.inf)
    found = min(slowest, problem.options.max_factor)
    for piece in states.pieces():
        torques = SplitTorques(problem.robot, piece.q, piece.dq, piece.ddq, links)
        factor = published_factor(torques, *problem.limits)
        if factor is None:
            return None
        found = min(found, factor)
    return found


def result_data(answer: Answer) -> dict[str, Any]:
    """Everything that was found, as plain data."""
    problem, sampled, proof = answer.problem, answer.sampled, answer.proof
    options, duration = problem.options, problem.trajectory.duration
    factor = sampled.factor
    decides = None
    if factor is not None and sampled.critical is not None:
        decides = critical_data(problem, sampled.critical, factor)
    explanation = infeasible(problem, sampled.critical) if factor is None else None
    if factor is not None and answer.used is None:
        explanation = "safe at the samples, but no factor could be proven for the times between them"
    return {
        "robot": problem.robot.name,
        "trajectory": problem.loaded.name,
        "method": options.method,
        "feasible": answer.used is not None,
        "factor": factor,
        "certified_factor": proof.factor if proof is not None else None,
        "duration": duration,
        "new_duration": duration / answer.used if answer.used is not None else None,
        "critical": decides,
        "explanation": explanation,
        "free": [list(part) for part in sampled.free],
        "gaps": [list(part) for part in gaps(sampled.free, options.min_factor)],
        "proven": [list(part) for part in proof.free] if proof is not None else None,
        "cells": proof.cells.count if proof is not None else None,
        "compared": answer.compared,
        "samples": answer.samples,
        "warnings": list(motion_warnings(problem)),
        "options": options.data,
    }
