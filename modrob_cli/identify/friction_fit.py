"""What the rigid bodies leave unexplained, as friction, rotor inertia and offset of each joint."""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.signals import Signals

TERMS = ("offset", "coulomb", "viscous", "reflected_inertia")
"""Terms of the fit, in the order in which they are admitted: one that those before it nearly imply is left out."""

INDEPENDENT = 0.05
"""Least share of a column that must not be explained by the columns before it."""


@dataclass(frozen=True)
class JointFit:
    """Fitted terms of one joint, link side.

    Attributes
    ----------
    offset, coulomb : [N m] or [N];  viscous : [N m s/rad] or [N s/m]
    reflected_inertia : rotor inertia times the square of the gear ratio, [kg m^2] or [kg]
    notes : what was left out or looks implausible, in words
    A term that the motion does not excite is None.
    """

    offset: float | None
    coulomb: float | None
    viscous: float | None
    reflected_inertia: float | None
    notes: tuple[str, ...]

    def values(self) -> Array:
        """Values in the order of :data:`TERMS`, with 0 for terms that were left out, shape (4,)."""
        return np.array([getattr(self, term) or 0.0 for term in TERMS])


def soft_sign(dq: Array, band: Array | float) -> Array:
    """Sign of dq that passes through zero along a straight line of half-width ``band``; 0 where both are 0."""
    return np.clip(dq / np.maximum(band, np.finfo(float).tiny), -1.0, 1.0)


def columns(dq: Array, ddq: Array, band: float) -> Array:
    """Regressors of one joint in the order of :data:`TERMS`, shape (N, 4), from velocities and accelerations (N,)."""
    return np.stack([np.ones_like(dq), soft_sign(dq, band), dq, ddq], axis=1)


def fit_friction(signals: Signals, unexplained: Array) -> tuple[list[JointFit], Array]:
    """Fit I_eq ddq + b_v dq + b_c sgn(dq) + offset to what is left of the torque. [D] 2.6.2, per joint.

    Ordinary least squares over the used samples outside the band around standstill, where the sign is uncertain.

    Parameters
    ----------
    unexplained : recorded torque minus that of the rigid bodies, shape (N, n), [N m] or [N]

    Returns
    -------
    fits : one per joint
    torque : the fitted terms over all samples, shape (N, n); within the band the sign is replaced by dq / band
    """
    fits = []
    torque = np.empty_like(unexplained)
    for j in range(unexplained.shape[1]):
        dq, ddq, band = signals.dq[:, j], signals.ddq[:, j], float(signals.band[j])
        phi = columns(dq, ddq, band)
        chosen = signals.used & (np.abs(dq) > band) if signals.moving[j] else signals.used
        fit = _fit_joint(phi[chosen], unexplained[chosen, j], bool(signals.moving[j]))
        torque[:, j] = phi @ fit.values()
        fits.append(fit)
    return fits, torque


def _fit_joint(phi: Array, target: Array, moving: bool) -> JointFit:
    admitted = _independent(phi) if moving else [0]
    scale = np.linalg.norm(phi[:, admitted], axis=0)
    solution = np.linalg.lstsq(phi[:, admitted] / scale, target, rcond=None)[0] / scale
    values = {TERMS[k]: float(value) for k, value in zip(admitted, solution, strict=True)}
    missing = [term for term in TERMS if term not in values]
    notes = []
    if not moving:
        notes.append("hardly moves: only the offset was fitted")
    elif missing:
        notes.append(f"left out, the motion does not tell it from the other terms: {', '.join(missing)}")
    negative = [term for term in TERMS[1:] if values.get(term, 0.0) < 0.0]
    if negative:
        notes.append(f"negative, so it makes up for errors of the model: {', '.join(negative)}")
    return JointFit(
        offset=values.get("offset"),
        coulomb=values.get("coulomb"),
        viscous=values.get("viscous"),
        reflected_inertia=values.get("reflected_inertia"),
        notes=tuple(notes),
    )


def _independent(phi: Array) -> list[int]:
    """Columns of which those admitted before leave at least the share :data:`INDEPENDENT`."""
    admitted: list[int] = []
    basis = np.empty((len(phi), 0))
    for k in range(phi.shape[1]):
        column = phi[:, k]
        rest = column - basis @ (basis.T @ column)
        if np.linalg.norm(rest) > INDEPENDENT * np.linalg.norm(column):
            admitted.append(k)
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
    return admitted
