"""``modrob identify --rigid-body``: base parameters, their distance from the robot file, and whose data are wrong."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from modrob_cli.identify.base_report import BaseParameterReport, base_parameter_report
from modrob_cli.identify.base_runs import TorqueRun
from modrob_cli.identify.physical_fit import PhysicalFit
from modrob_cli.identify.regression_rows import row_mask
from modrob_cli.identify.run import Run
from modrob_cli.io.csv_writer import csv_text
from modrob_cli.model.body import tensor_entries
from modrob_cli.model.robot import Robot


def base_report(robot: Robot, runs: Sequence[Run]) -> BaseParameterReport:
    """Base parameters from the samples that the regression of the friction uses too."""
    found = []
    for run in runs:
        use = np.stack([row_mask(run, j) for j in range(robot.dof)], axis=1)
        # The torque as recorded: a filter would blur the jumps of the friction there, but not in the regressor.
        found.append(TorqueRun(run.name, run.t, run.q, run.dq, run.ddq, run.tau, use))
    return base_parameter_report(robot, found, gravity=all(run.gravity for run in runs))


def base_entry(report: BaseParameterReport) -> dict[str, Any]:
    """The report as plain data."""
    return {
        "suspects": [
            {
                "link": item.correction.link,
                "name": item.name,
                "kind": item.correction.kind,
                "mass_factor": item.correction.mass_factor,
                "share": item.correction.share,
                "explained": item.correction.explained,
                "rivals": list(item.rivals),
                "text": item.text,
            }
            for item in report.suspects
        ],
        "parameters": [
            {
                "name": item.name,
                "formula": item.formula,
                "unit": item.unit,
                "rigid": item.is_rigid,
                "nominal": item.nominal,
                "value": item.value,
                "stderr": item.stderr,
                "interval": None if item.interval is None else list(item.interval),
                "distance": item.distance,
            }
            for item in report.parameters
        ],
        "count": len(report.parameters),
        "condition": float(report.fit.condition),
        "residual_nominal": report.sigma.tolist(),
        "residual_fitted": report.sigma_fitted.tolist(),
        "silent_links": list(report.silent),
        "physical": _physical(report.physical),
        "notes": list(report.notes),
    }


def _physical(fit: PhysicalFit | None) -> dict[str, Any] | None:
    """Standard parameters that real bodies can have, link frames; drives on the link side."""
    if fit is None:
        return None
    links = []
    for link in fit.links:
        mass, com, inertia = link.central()
        links.append({"mass": mass, "com": com.tolist(), "inertia_com": tensor_entries(inertia).tolist()})
    drives = {key: getattr(fit, key).tolist() for key in ("offset", "coulomb", "viscous", "armature")}
    return {"misfit": fit.misfit, "adjusted": list(fit.adjusted), "links": links, **drives}


def base_csv(report: BaseParameterReport) -> str:
    """Table of the base parameters."""
    header = ("parameter", "formula", "unit", "robot_file", "value", "stderr", "lower", "upper", "distance_in_stderr")
    rows = [
        (p.name, p.formula, p.unit, p.nominal, p.value, p.stderr, *(p.interval or (None, None)), p.distance)
        for p in report.parameters
    ]
    return csv_text(header, rows)
