"""What the regression of one joint came to."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.covariance import quantile
from modrob_cli.identify.friction_terms import FrictionShape, JointMotion, columns

DIRECTIONAL = {
    "coulomb_forward": ("coulomb", "offset", 1.0),
    "coulomb_backward": ("coulomb", "offset", -1.0),
    "viscous_forward": ("viscous", "asymmetric", 1.0),
    "viscous_backward": ("viscous", "asymmetric", -1.0),
}
"""Friction in each direction: the term, the one that is added to it, and its sign."""


@dataclass(frozen=True)
class Estimate:
    """A parameter with its uncertainty.

    Attributes
    ----------
    value : None if the motion does not tell it
    stderr : standard error
    interval : confidence interval
    dof : degrees of freedom of Student's t behind it
    reason : why there is no value
    """

    value: float | None
    stderr: float | None = None
    interval: tuple[float, float] | None = None
    dof: float | None = None
    reason: str = ""


@dataclass(frozen=True)
class JointEstimate:
    """Parameters of one joint, link side.

    Attributes
    ----------
    estimates : one for each term asked for; offset, coulomb, load-free Stribeck [N m] or [N], viscous and asymmetric
        [N m s/rad] or [N s/m], reflected_inertia [kg m^2] or [kg], load [-], stribeck_velocity and
        transition_width [rad/s] or [m/s], drive_gain [N m/A] or [N/A]
    constrained : all values under the condition that none is negative that cannot be; None if none is
    held : values of terms without estimate that the model keeps (from the robot file)
    width : the Coulomb torque changes sign like tanh(dq / width), [rad/s] or [m/s]
    terms, correlation : names and correlation matrix of the estimates
    condition : condition number of the scaled columns
    samples, effective_samples : rows of the regression; independent ones that carry as much
    bandwidth : of the standard errors, [Hz]
    outliers : share of the rows whose weight was reduced
    rms : of the residual of the filtered rows, [N m] or [N]
    offsets : of each log, where they were fitted log by log
    notes : what else is to be said, in words
    """

    estimates: Mapping[str, Estimate]
    constrained: Mapping[str, float] | None
    held: Mapping[str, float]
    width: float
    terms: tuple[str, ...]
    correlation: Array
    condition: float
    samples: int
    effective_samples: float
    bandwidth: float
    outliers: float
    rms: float
    offsets: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def value(self, term: str) -> float | None:
        """Estimated value of a term; None if there is none."""
        estimate = self.estimates.get(term)
        return None if estimate is None else estimate.value

    def model(self, physical: bool = False) -> dict[str, float]:
        """Values that a prediction uses: the estimates, or those without negative ones, and what is held."""
        apart = ("drive_gain", *DIRECTIONAL)
        values = {term: e.value for term, e in self.estimates.items() if e.value is not None and term not in apart}
        if physical and self.constrained is not None:
            values |= self.constrained
        return {**self.held, **values}

    def torque(self, motion: JointMotion, log: str | None = None, physical: bool = False) -> Array:
        """Friction, rotor and offset torque along a motion, shape (N,); ``log`` picks its own offset, if it has one."""
        values = self.model(physical)
        velocity = values.pop("stribeck_velocity", None)
        values.pop("transition_width", None)
        if log is not None and log in self.offsets:
            values["offset"] = self.offsets[log]
        shape = FrictionShape(self.width, velocity)
        return np.asarray(columns(list(values), motion, shape) @ np.array(list(values.values())))

    def curve(self, dq: Array, load: float = 0.0, confidence: float = 0.95) -> tuple[Array, Array]:
        """Friction and offset over the velocity, and the half-width of the curve's confidence band.

        Parameters
        ----------
        dq : shape (N,), [rad/s] or [m/s];  load : rigid-body torque, [N m] or [N]
        """
        motion = JointMotion(dq, np.zeros_like(dq), np.full_like(dq, load))
        shape = FrictionShape(self.width, self.value("stribeck_velocity"))
        slopes = {"transition_width": "coulomb", "stribeck_velocity": "stribeck"}
        known = [k for k, term in enumerate(self.terms) if term not in ("reflected_inertia", "drive_gain")]
        parts = []
        for k in known:
            term = self.terms[k]
            if term in slopes:
                slope = columns([f"{slopes[term]}_slope"], motion, shape)[:, 0]
                parts.append(slope * (self.value(slopes[term]) or 0.0))
            else:
                parts.append(columns([term], motion, shape)[:, 0])
        phi = np.stack(parts, axis=1) if parts else np.empty((len(dq), 0))
        stderr = np.array([self.estimates[self.terms[k]].stderr or 0.0 for k in known])
        dof = np.array([self.estimates[self.terms[k]].dof or np.inf for k in known])
        matrix = self.correlation[np.ix_(known, known)] * np.outer(stderr, stderr)
        variance = np.maximum(np.einsum("nk,kl,nl->n", phi, matrix, phi), 0.0)
        half = float(quantile(confidence, np.min(dof))) * np.sqrt(variance) if len(dof) else np.zeros_like(dq)
        return self.torque(motion), half
