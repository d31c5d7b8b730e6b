"""Friction, rotor inertia and offset of each joint by robust linear regression. [D] 2.6.2, 4.8.2."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify import regression_excitation as excitation
from modrob_cli.identify.covariance import Covariance, correlations, covariance, quantile
from modrob_cli.identify.friction_terms import NON_NEGATIVE, FrictionModel, FrictionShape, columns
from modrob_cli.identify.regression_result import Estimate, JointEstimate
from modrob_cli.identify.regression_rows import Rows, filtered_column, joint_motion, joint_rows
from modrob_cli.identify.regression_stribeck import sharpest, stribeck_velocity, transition_width
from modrob_cli.identify.regression_units import GAIN, directional, fit_notes, in_torque
from modrob_cli.identify.robust import RobustFit, robust_fit
from modrob_cli.identify.run import Run


@dataclass(frozen=True)
class RegressionOptions:
    """How joints are fitted.

    Attributes
    ----------
    model : friction terms
    confidence : of the intervals
    robust : outliers get less weight
    offset_per_log : each log has an offset of its own
    drive_gain : what was recorded is in unknown units; joint torque per unit is fitted too
    """

    model: FrictionModel = field(default_factory=FrictionModel)
    confidence: float = 0.95
    robust: bool = True
    offset_per_log: bool = False
    drive_gain: bool = False


@dataclass(frozen=True)
class JointPrior:
    """What is known about a joint before the fit.

    Attributes
    ----------
    held : values by term (coulomb, viscous, reflected_inertia) that the model keeps where the motion tells none
    inertia : what the joint feels of the rigid bodies, [kg m^2] or [kg], against which a rotor is judged
    """

    held: Mapping[str, float]
    inertia: float


def fit_joint(runs: Sequence[Run], j: int, options: RegressionOptions, prior: JointPrior) -> JointEstimate:
    """Fit the terms of joint j to what the rigid bodies leave of the torque, over the used samples of all runs.

    A term that the motion does not excite is left out, with the reason; the robot file's value is kept for it.
    Standard errors hold for correlated residuals (:mod:`modrob_cli.identify.covariance`).

    Raises
    ------
    NumericalError
        If too few samples are left.
    """
    wanted = list(options.model.terms)
    left_out: dict[str, str] = {}
    if not any(run.signals.moving[j] for run in runs):
        left_out = dict.fromkeys(wanted[1:], "the joint hardly moves, or its velocity drowns in noise")
    left_out |= excitation.noisy_terms(runs, j, [term for term in wanted if term not in left_out])
    while True:
        problem = _Problem(runs, j, options, prior, [term for term in wanted if term not in left_out])
        problem.drop_dependent(left_out)
        solution = problem.solve(left_out)
        wild = excitation.wild_term(problem.rows, solution.fit.values, solution.half_widths, prior.inertia)
        if wild is None:
            return problem.result(solution, left_out)
        left_out[wild[0]] = wild[1]


@dataclass(frozen=True)
class _Solution:
    """A fit with its uncertainty, in which the velocities that were searched for come last."""

    fit: RobustFit
    cov: Covariance
    half_widths: Array


class _Problem:
    """The regression of one joint with a choice of terms."""

    def __init__(
        self, runs: Sequence[Run], j: int, options: RegressionOptions, prior: JointPrior, terms: list[str]
    ) -> None:
        self.runs, self.j, self.options = runs, j, options
        absent = [term for term in prior.held if term not in terms]
        # What is held has no known torque in units of a record with an unknown gain, nor at rest, where friction may
        # be anything up to the Coulomb torque.
        known = not options.drive_gain and any(run.signals.moving[j] for run in runs)
        self.held = {term: prior.held[term] for term in absent if prior.held[term]} if known else {}
        self.stribeck = "stribeck" in terms
        self.shape = FrictionShape(sharpest(runs, j))
        self._build([term for term in terms if term != "stribeck"])

    def _build(self, terms: list[str]) -> None:
        """Rows of these terms with the present shape."""
        runs, j, options = self.runs, self.j, self.options
        self.all_rows = joint_rows(runs, j, terms, self.shape, [self._target(run) for run in runs])
        if options.drive_gain and any(run.signals.moving[j] for run in runs):
            self.all_rows = self._with_gain(self.all_rows)
        if options.offset_per_log:
            self.all_rows = self.all_rows.only([term for term in self.all_rows.terms if term != "offset"])
        self.rows = self._centred(self.all_rows)

    def _target(self, run: Run) -> Array:
        recorded = run.tau[:, self.j]
        if self.options.drive_gain:
            return recorded
        known = columns(list(self.held), joint_motion(run, self.j), self.shape) @ np.array(list(self.held.values()))
        return np.asarray(recorded - run.tau_rigid[:, self.j] - known)

    def _with_gain(self, rows: Rows) -> Rows:
        """The rigid-body torque as second column, where it is admitted right after the offset."""
        parts = []
        for k, mine in rows.timeline.spans():
            index = rows.timeline.index[mine]
            parts.append(self.runs[k].filtered(self.runs[k].tau_rigid[:, self.j])[index])
        wider = rows.joined(GAIN, np.concatenate(parts))
        return wider.only(["offset", GAIN, *rows.terms[1:]])

    def _centred(self, rows: Rows) -> Rows:
        return rows.centred() if self.options.offset_per_log else rows

    def drop_dependent(self, left_out: dict[str, str]) -> None:
        """Leave out columns that those before them nearly imply."""
        admitted = excitation.independent(self.rows.phi)
        for k, term in enumerate(self.rows.terms):
            if k not in admitted:
                left_out[term] = "the motion does not tell it from the other terms"
        self.all_rows = self.all_rows.only([self.rows.terms[k] for k in admitted])
        self.rows = self._centred(self.all_rows)

    def solve(self, left_out: dict[str, str]) -> _Solution:
        """Robust fit, the search for the nonlinear velocities included, and its covariance."""
        per_log = self.options.offset_per_log
        fit = robust_fit(self.rows.phi, self.rows.target, self.options.robust)
        if "coulomb" in self.rows.terms:
            width = transition_width(self.runs, self.j, self.all_rows, fit, per_log)
            if width > self.shape.width:
                self.shape = FrictionShape(width)
                self._build([term for term in self.all_rows.terms if term != GAIN])
                fit = robust_fit(self.rows.phi, self.rows.target, self.options.robust)
        if self.stribeck and "coulomb" in self.rows.terms:
            found = stribeck_velocity(self.runs, self.j, self.all_rows, fit.weights, self.shape.width, per_log)
            if isinstance(found, str):
                left_out["stribeck"] = found
            else:
                self.shape = FrictionShape(self.shape.width, found)
                column = filtered_column(self.runs, self.j, "stribeck", self.shape)
                self.all_rows = self.all_rows.joined("stribeck", column)
                self.rows = self._centred(self.all_rows)
                fit = robust_fit(self.rows.phi, self.rows.target, self.options.robust)
        cov = covariance(self._jacobian(fit), fit.residual, fit.weights, self.rows.timeline)
        return _Solution(fit, cov, quantile(self.options.confidence, cov.dof) * cov.stderr)

    def _nonlinear(self) -> dict[str, tuple[str, float]]:
        """Velocities that were searched for: the term that each shapes, and its value."""
        found = {}
        if "coulomb" in self.rows.terms and self.shape.width > sharpest(self.runs, self.j):
            found["transition_width"] = ("coulomb", self.shape.width)
        if self.shape.stribeck_velocity is not None:
            found["stribeck_velocity"] = ("stribeck", self.shape.stribeck_velocity)
        return found

    def _jacobian(self, fit: RobustFit) -> Array:
        """Derivatives of the model: the columns, and those with respect to the searched velocities."""
        rows = self.all_rows
        for name, (term, _) in self._nonlinear().items():
            slope = filtered_column(self.runs, self.j, f"{term}_slope", self.shape)
            rows = rows.joined(name, fit.values[self.rows.terms.index(term)] * slope)
        return self._centred(rows).phi

    def result(self, solution: _Solution, left_out: Mapping[str, str]) -> JointEstimate:
        """Everything in terms of joint torque."""
        terms = list(self.rows.terms)
        values, matrix, stderr = solution.fit.values, solution.cov.matrix, solution.cov.stderr
        for name, (_, value) in self._nonlinear().items():
            terms, values = [*terms, name], np.append(values, value)
        scale = 1.0
        if GAIN in terms:
            terms, values, matrix, stderr, scale = in_torque(terms, values, matrix, stderr)
        half = quantile(self.options.confidence, solution.cov.dof) * stderr
        estimates = {
            term: Estimate(float(x), float(se), (float(x - h), float(x + h)), float(dof))
            for term, x, se, h, dof in zip(terms, values, stderr, half, solution.cov.dof, strict=True)
        }
        correlation = correlations(matrix)
        if self.options.model.asymmetric:
            estimates |= directional(estimates, terms, correlation, self.options.confidence)
        estimates |= {term: Estimate(None, reason=reason) for term, reason in left_out.items() if term != GAIN}
        if GAIN in left_out:
            estimates["drive_gain"] = Estimate(None, reason=left_out[GAIN])
        return JointEstimate(
            estimates=estimates,
            constrained=self._constrained(estimates, scale),
            held=self.held,
            width=self.shape.width,
            terms=tuple(terms),
            correlation=correlation,
            condition=self.rows.scaled_condition(),
            samples=len(self.rows.target),
            effective_samples=solution.cov.effective_samples,
            bandwidth=solution.cov.bandwidth,
            outliers=solution.fit.outliers,
            rms=float(np.sqrt(np.mean(solution.fit.residual**2))) * scale,
            offsets=self._offsets(solution, scale),
            notes=fit_notes(estimates, solution.fit.outliers),
        )

    def _constrained(self, estimates: Mapping[str, Estimate], scale: float) -> dict[str, float] | None:
        """Fit again with no negative value where none can be; None if there was none."""
        negative = [t for t in NON_NEGATIVE if t in estimates and (estimates[t].value or 0.0) < 0.0]
        if not negative:
            return None
        from scipy.optimize import lsq_linear

        size = np.linalg.norm(self.rows.phi, axis=0)
        lower = np.array([0.0 if term in (*NON_NEGATIVE, GAIN) else -np.inf for term in self.rows.terms])
        weights = robust_fit(self.rows.phi, self.rows.target, self.options.robust).weights
        root = np.sqrt(weights)
        found = lsq_linear(self.rows.phi / size * root[:, None], self.rows.target * root, (lower, np.inf))
        values = dict(zip(self.rows.terms, (found.x / size).tolist(), strict=True))
        share = values.pop(GAIN, None)
        if share is not None and share > 0.0:
            scale = 1.0 / share
        return {term: scale * value for term, value in values.items()}

    def _offsets(self, solution: _Solution, scale: float) -> dict[str, float]:
        """Offset of each log, if each has its own."""
        if not self.options.offset_per_log:
            return {}
        rest = self.all_rows.target - self.all_rows.phi @ solution.fit.values
        spans = self.rows.timeline.spans()
        return {self.runs[k].name: scale * float(np.mean(rest[mine])) for k, mine in spans}
