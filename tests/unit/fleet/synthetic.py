"""Results of many validated logs, made up."""

from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

JOINTS = ("shoulder", "slide")


def results(count: int, drift: float = 0.0, dated: bool = True, seed: int = 1) -> list[dict[str, Any]]:
    """Logs over 300 days; the NRMSE of the first joint rises by the share ``drift`` in that time."""
    rng = np.random.default_rng(seed)
    days = np.sort(rng.uniform(0.0, 300.0, count))
    return [log(k, days[k] if dated else None, 1.0 + drift * days[k] / 300.0, rng) for k in range(count)]


def log(k: int, day: float | None, growth: float, rng: np.random.Generator) -> dict[str, Any]:
    start = datetime(2026, 1, 5, 8, tzinfo=UTC)
    date = None if day is None else (start + timedelta(days=float(day))).strftime("%Y-%m-%dT%H:%M:%SZ")
    joints: list[dict[str, Any]] = []
    for j, name in enumerate(JOINTS):
        ratio = float(0.1 * np.exp(0.1 * rng.normal())) * (growth if j == 0 else 1.0)
        fit = {"offset": 0.1, "coulomb": 2.0 + 0.1 * float(rng.normal()), "viscous": 5.0, "reflected_inertia": None}
        joints.append(
            {
                "name": name,
                "unit": "N m" if j == 0 else "N",
                "rmse": 3.0 * ratio,
                "nrmse": ratio,
                "nrmse_low_passed": 0.8 * ratio,
                "max_error": 10.0 * ratio,
                "worst_time": 3.2,
                "inside": 1.0 - 0.01 * float(rng.random()),
                "mean_width": 2.0,
                "passed": None,
                "fit": fit,
                "notes": [],
            }
        )
    return {
        "log": f"runs/run_{k}.mcap",
        "name": f"run_{k}",
        "date": date,
        "page": None,
        "picture": None,
        "joints": joints,
        "duration": 30.0,
        "samples": 30000,
        "samples_used": 29000,
        "fitted_to_these_samples": False,
        "seconds_left_out": 0.0,
        "repeated_stamps": 0,
        "notes": [],
        "rate": 1000.0,
        "resampled": False,
        "longest_gap": 0.002,
        "cutoff": 20.0,
        "velocity": "recorded",
        "effort": "torque",
    }


def whole(logs: list[dict[str, Any]], skipped: list[dict[str, Any]] | None = None) -> dict[str, Any]:
    """The result of all logs."""
    verdicts = [joint["passed"] for one in logs for joint in one["joints"]]
    passed = None if all(verdict is None for verdict in verdicts) else not skipped and False not in verdicts
    return {
        "passed": passed,
        "friction": "held-out",
        "scope": "The scope.",
        "skipped": skipped or [],
        "options": {},
        "logs": logs,
        "provenance": {"modrob": "1", "inputs": {one["name"]: "sha256:" + "0" * 64 for one in logs}},
    }
