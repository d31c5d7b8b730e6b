"""Which terms a motion excites: verdicts instead of wild numbers."""

from collections.abc import Sequence

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.regression_rows import Rows
from modrob_cli.identify.run import Run

INDEPENDENT = 0.05
"""Least share of a column that must not be explained by the columns before it."""

NOISE_SHARE = 0.1
"""Largest share of noise in the power of a regressor; by this share noise in it makes its estimate too small."""

LEAST_LOAD = 0.05
"""Least RMS of the rigid-body torque over that of the recorded one for friction that depends on it."""


def independent(phi: Array) -> list[int]:
    """Columns of which those admitted before leave at least the share :data:`INDEPENDENT`."""
    admitted: list[int] = []
    basis = np.empty((len(phi), 0))
    for k in range(phi.shape[1]):
        column = phi[:, k]
        size = np.linalg.norm(column)
        rest = column - basis @ (basis.T @ column)
        if np.linalg.norm(rest) > INDEPENDENT * size:
            admitted.append(k)
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
    return admitted


def noisy_terms(runs: Sequence[Run], j: int, terms: Sequence[str]) -> dict[str, str]:
    """Terms whose regressor is noise for the most part of what matters, with the reason.

    Noise in a regressor pulls its estimate toward zero by its share of the power (attenuation), and no standard
    error shows that.
    """
    found: dict[str, str] = {}
    cases = (("reflected_inertia", "acceleration", "ddq"), ("viscous", "velocity", "dq"))
    for term, name, key in cases:
        moving = [run for run in runs if run.signals.moving[j] and run.used.any()]
        if term not in terms or not moving:
            continue
        count = sum(int(run.used.sum()) for run in moving)
        power = sum(float(np.sum(getattr(run, key)[run.used, j] ** 2)) for run in moving) / count
        noise = sum(float(getattr(run, f"noise_{key}")[j] ** 2) * int(run.used.sum()) for run in moving) / count
        if noise > NOISE_SHARE * power:
            share = min(noise / max(power, np.finfo(float).tiny), 1.0)
            found[term] = f"{share:.0%} of the {name}'s power is noise; use a lower --cutoff or a livelier motion"
    if "load" in terms:
        load, recorded = (
            np.sqrt(sum(float(np.sum(x[run.used, j] ** 2)) for run in runs for x in [getattr(run, key)]))
            for key in ("tau_rigid", "tau")
        )
        if not load > LEAST_LOAD * recorded:
            found["load"] = "the rigid bodies hardly load this joint"
    return found


def wild_term(rows: Rows, values: Array, half_widths: Array, inertia: float) -> tuple[str, str] | None:
    """The term that is least certain among those too uncertain to mean anything, with the reason.

    A rotor inertia whose interval contains zero and is wider than what the joint feels of the rigid bodies; any
    other term whose interval contains zero and allows for more torque than there is to explain. The offset stays.
    """
    level = float(np.sqrt(np.mean((rows.target - np.mean(rows.target)) ** 2)))
    worst: tuple[float, str, str] | None = None
    for k, term in enumerate(rows.terms):
        half = float(half_widths[k])
        if term == "offset" or abs(values[k]) > half:
            continue
        size = float(np.sqrt(np.mean(rows.phi[:, k] ** 2)))
        excess = half * size / max(level, np.finfo(float).tiny)
        reason = f"+-{half:.3g} is all that can be said"
        if term == "reflected_inertia":
            excess = max(excess, half / inertia if inertia > 0.0 else np.inf)
            reason += f", the rigid bodies themselves being {inertia:.3g}: the accelerations are too small"
        if excess > 1.0 and (worst is None or excess > worst[0]):
            worst = (excess, term, reason)
    return None if worst is None else worst[1:]
