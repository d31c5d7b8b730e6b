"""Standard parameters that real bodies can have and that give the estimated base parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.link_inertia import LinearParameters
from modrob_cli.dynamics.newton_euler import nominal_links
from modrob_cli.dynamics.regressor import PARAMETERS
from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.identify.base_columns import nominal_values
from modrob_cli.identify.base_estimate import BaseEstimate
from modrob_cli.identify.base_parameters import BaseModel
from modrob_cli.identify.physical_inertia import (
    body_from,
    from_parameter_vector,
    nearest_consistent,
    pseudo_inertia,
)
from modrob_cli.identify.updated_robot import motor_side, with_friction
from modrob_cli.interval import Interval
from modrob_cli.model.body import PlacedBody, RigidBody, tensor_entries
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain

PRIOR = 0.15
"""How far the numbers theta of a link may be from the robot file's where recordings say nothing: a standard deviation
in logarithmic units, about 30 % in mass (theta_0 counts twice) and 15 % in size."""

_LOOSE = 100.0
"""Standard deviation of drive parameters, in multiples of the largest torque that they explain: next to no prior."""


_DOUBTS = (100.0, 10.0, 1.0)
"""Factors on the standard errors, one fit after the other: a loose one leads into the neighbourhood of the next."""


@dataclass(frozen=True)
class PhysicalFit:
    """Links of positive definite pseudo-inertia and drives without negative friction or rotor inertia.

    Attributes
    ----------
    links : parameters of links 1..n in their link frames; massless ones stay massless
    offset, coulomb, viscous, armature : of each joint, link side, shape (n,)
    misfit : root mean square distance of the base parameters from their estimates, in standard errors; far above 1
        means that no real bodies have the estimated values: the model lacks something
    adjusted : links whose given data no real body has, which were mended before the fit
    """

    links: tuple[LinearParameters, ...]
    offset: Array
    coulomb: Array
    viscous: Array
    armature: Array
    misfit: float
    adjusted: tuple[int, ...]


def physical_fit(robot: Robot, model: BaseModel, fit: BaseEstimate) -> PhysicalFit:
    """Find consistent parameters near those of the robot file that explain the recordings.

    Minimises the squared distance of the base parameters from their estimates in the metric of their covariance, plus
    the squared distance of theta from 0 divided by :data:`PRIOR`; nonlinear least squares with bounds, no semidefinite
    programme. The prior decides only what recordings do not: a maximum a posteriori estimate.

    Raises
    ------
    NumericalError
        If the covariance of the estimate is singular beyond repair.
    """
    from scipy.optimize import least_squares

    n = robot.dof
    given = nominal_links(robot)
    start = {i: nearest_consistent(link) for i, link in enumerate(given) if link.mass > 0.0}
    roots = {i: np.asarray(np.linalg.cholesky(pseudo_inertia(link)), dtype=float) for i, link in start.items()}
    whiten = _whitener(fit.covariance) @ model.grouping.transform[fit.excited]
    target = _whitener(fit.covariance) @ fit.deviation[fit.excited]
    nominal = nominal_values(robot)
    drives, bodies = nominal[10 * n :], 10 * len(start)
    spread = _LOOSE * np.tile(fit.sigma_before, 4)

    def standard(x: Array) -> tuple[Array, Array]:
        pi = np.concatenate([nominal[: 10 * n], x[bodies:]])
        slopes = np.zeros((14 * n, len(x)))
        slopes[10 * n :, bodies:] = np.eye(4 * n)
        for k, (i, root) in enumerate(roots.items()):
            own, free = slice(10 * i, 10 * i + 10), slice(10 * k, 10 * k + 10)
            pi[own], slopes[own, free] = body_from(x[free], root)
        return pi, slopes

    prior = np.concatenate([np.full(bodies, 1.0 / PRIOR), 1.0 / spread])
    centre = np.concatenate([np.zeros(bodies), drives])
    low = np.concatenate([np.full(bodies + n, -np.inf), np.zeros(3 * n)])
    x = np.maximum(np.concatenate([np.zeros(bodies), _drives_alone(model, fit, nominal)]), low + 1e-9)
    for doubt in _DOUBTS:

        def residual(x: Array, doubt: float = doubt) -> Array:
            misfit = whiten @ (standard(x)[0] - nominal) - target
            return np.concatenate([misfit / doubt, prior * (x - centre)])

        def slope(x: Array, doubt: float = doubt) -> Array:
            return np.vstack([whiten @ standard(x)[1] / doubt, np.diag(prior)])

        solved = least_squares(residual, x, slope, bounds=(low, np.inf), x_scale="jac", max_nfev=100)
        x = np.maximum(solved.x, low + 1e-9)
    pi = standard(solved.x)[0]
    if not np.isfinite(pi).all():
        raise NumericalError("no consistent parameters were found; the estimated base parameters are not usable")
    links = tuple(from_parameter_vector(row) for row in pi[: 10 * n].reshape(n, 10))
    offset, coulomb, viscous, armature = pi[10 * n :].reshape(4, n)
    misfit = float(np.sqrt(np.mean((whiten @ (pi - nominal) - target) ** 2)))
    adjusted = tuple(
        i + 1 for i, link in start.items() if not np.allclose(link.inertia, given[i].inertia, rtol=1e-9, atol=1e-12)
    )
    return PhysicalFit(links, offset, coulomb, viscous, armature, misfit, adjusted)


def _drives_alone(model: BaseModel, fit: BaseEstimate, nominal: Array) -> Array:
    """Drive parameters (4 n,) as if all deviation in groups that are named after them were theirs: where to start."""
    values = nominal.copy()
    values[model.grouping.independent] += fit.deviation
    return np.asarray(values[len(PARAMETERS) * len(nominal) // 14 :])


def _whitener(covariance: Array) -> Array:
    """Matrix whose product with a deviation has unit covariance; directions of no information count little."""
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > 1e-12 * values[-1]
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])).T / scale)


def physical_robot(robot: Robot, fit: PhysicalFit) -> Robot:
    """The same arm with the links and drives of a fit, as exact values; limits, gears and bands stay.

    Offsets, which a robot file does not have, are added to the disturbance, whose width stays. A rotor stays as it is
    where the gear ratio is zero.
    """
    frictions, rotors = [], []
    for joint, coulomb, viscous, armature in zip(robot.joints, fit.coulomb, fit.viscous, fit.armature, strict=True):
        frictions.append(replace(joint.friction, viscous=Uncertain.exact(viscous), coulomb=Uncertain.exact(coulomb)))
        own = joint.drive.rotor_inertia
        rotors.append(motor_side(Uncertain.exact(armature), joint.drive) if joint.drive.gear_ratio else own)
    return with_friction(with_links(robot, fit.links), frictions, rotors, robot.disturbance + Interval(fit.offset))


def with_links(robot: Robot, links: Sequence[LinearParameters]) -> Robot:
    """The same arm with other nominal bodies: one per link in the link's frame, without a box.

    The bodies of the base stay. The boxes of the replaced bodies are gone: identification tells combinations of
    parameters, which boxes around single ones cannot describe.

    Raises
    ------
    ShapeError
        If there are not as many links as joints.
    """
    if len(links) != robot.dof:
        raise ShapeError(f"{len(links)} links for {robot.dof} joints")
    bodies = list(robot.bodies_of(0))
    for i, link in enumerate(links, start=1):
        mass, com, central = link.central()
        values = (Uncertain.exact(mass), Uncertain.exact(com), Uncertain.exact(tensor_entries(central)))
        bodies.append(PlacedBody(i, np.eye(4), RigidBody(f"link {i}, identified", *values)))
    return replace(robot, bodies=tuple(bodies))
