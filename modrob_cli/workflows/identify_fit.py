"""The regression over all joints, its errors, and its judgement."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.dynamics.newton_euler import rnea
from modrob_cli.errors import NumericalError
from modrob_cli.identify.friction_diagnosis import Coupling, GravityShare, coupling, gravity_share
from modrob_cli.identify.prediction_pooled import PooledError, error_sums, errors_of
from modrob_cli.identify.regression import JointPrior, RegressionOptions, fit_joint
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.regression_rows import joint_motion
from modrob_cli.identify.run import Run
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_runs import Parts

UNEXPLAINED = 0.5
"""NRMSE (low-passed) from which on a joint counts as unexplained: a model that misses half of the torque."""

GRAVITY_MISSING = 0.5
"""Share of the model's gravity below which it counts as missing from the record."""


@dataclass(frozen=True)
class Fitted:
    """A regression and how well it predicts.

    Attributes
    ----------
    estimates : one per joint
    train, test : errors per joint on the fitted and on the held-out part; ``test`` is None without such a part
    logs : errors per joint on each log, on its held-out part if it has one; None where nothing of it counts
    couplings : another joint that explains what is left, per joint
    gravity : share of the model's gravity in the record; None where gravity hardly matters
    """

    estimates: list[JointEstimate]
    train: list[PooledError] | None
    test: list[PooledError] | None
    logs: list[list[PooledError] | None]
    couplings: list[Coupling | None]
    gravity: GravityShare | None

    @property
    def judged(self) -> list[PooledError]:
        """Errors that count: those of the held-out part if there is one.

        Raises
        ------
        NumericalError
            If no sample is left in either.
        """
        found = self.test or self.train
        if found is None:
            raise NumericalError("no samples are left to judge the fit by; use longer logs or another --holdout")
        return found


def fit_all(
    robot: Robot,
    runs: Sequence[Parts],
    options: RegressionOptions,
    diagnose: bool = True,
    stage: Callable[[str, float], None] | None = None,
) -> Fitted:
    """Fit every joint to the training parts, predict both parts.

    Parameters
    ----------
    diagnose : also look for what the fit does not explain
    stage : told what is done, and which part of all is done

    Raises
    ------
    NumericalError
        If too few samples are left.
    """
    train, test = [item.train for item in runs], [item.test for item in runs]
    tell = stage or (lambda what, fraction: None)
    inertia = rigid_inertia(robot, train)
    priors = [JointPrior(_held(robot, j), inertia[j]) for j in range(robot.dof)]
    estimates = []
    for j, joint in enumerate(robot.joints):
        tell(f"fitting {joint.name}", 0.5 * j / robot.dof)
        estimates.append(fit_joint(train, j, options, priors[j]))
    train, test = scaled(train, estimates), scaled(test, estimates)
    sums = [error_sums(parts, predicted(parts[0], estimates)) for parts in zip(train, test, strict=True)]
    logs = [errors_of([parts[1] if parts[1].samples else parts[0]]) for parts in sums]
    errors = [errors_of([parts[k] for parts in sums]) for k in (0, 1)]
    fitted = Fitted(estimates, errors[0], errors[1], logs, [None] * robot.dof, None)
    if not diagnose:
        return fitted
    if not options.drive_gain:
        fitted = replace(fitted, gravity=_gravity_share(robot, train, estimates, options))
    if gravity_text(fitted, train[0].gravity) is not None:
        return fitted  # torque that is missing altogether correlates with other joints, which says nothing about them
    couplings = []
    for j, joint in enumerate(robot.joints):
        tell(f"judging {joint.name}", 0.5 + 0.5 * j / robot.dof)
        couplings.append(coupling(train, test, j, estimates[j]))
    return replace(fitted, couplings=couplings)


def _gravity_share(
    robot: Robot, runs: Sequence[Run], estimates: Sequence[JointEstimate], options: RegressionOptions
) -> GravityShare | None:
    """Share of what carries the arm at rest, which is computed here so that nothing holds it longer."""
    gravity = []
    for run in runs:
        still = np.zeros_like(run.q)
        gravity.append(rnea(robot, run.q, still, still))
    return gravity_share(runs, gravity, estimates, options)


def scaled(runs: Sequence[Run], estimates: Sequence[JointEstimate]) -> list[Run]:
    """The runs with their record turned into torque by the fitted gains, if there are any."""
    gains = np.array([estimate.value("drive_gain") or 1.0 for estimate in estimates])
    return list(runs) if np.all(gains == 1.0) else [replace(run, tau=run.tau * gains) for run in runs]


def predicted(run: Run, estimates: Sequence[JointEstimate]) -> Array:
    """Torque that rigid bodies and fitted terms predict, shape (N, n)."""
    extra = [estimate.torque(joint_motion(run, j), run.name) for j, estimate in enumerate(estimates)]
    return run.tau_rigid + np.stack(extra, axis=1)


def rigid_inertia(robot: Robot, runs: Sequence[Run]) -> list[float]:
    """Median of what each joint feels of the rigid bodies, the diagonal of M(q), over at most 200 poses."""
    q = np.concatenate([run.q[run.used] for run in runs])
    q = q[:: max(1, len(q) // 200)]
    if not len(q):
        return [0.0] * robot.dof
    floating, still = replace(robot, gravity=np.zeros(3)), np.zeros_like(q)
    unit = np.eye(robot.dof)
    return [float(np.median(rnea(floating, q, still, still + unit[j])[:, j])) for j in range(robot.dof)]


def _held(robot: Robot, j: int) -> dict[str, float]:
    """What the robot file says about a joint."""
    joint = robot.joints[j]
    armature = joint.drive.gear_ratio**2 * float(joint.drive.rotor_inertia.nominal)
    friction = joint.friction
    return {
        "coulomb": float(friction.coulomb.nominal),
        "viscous": float(friction.viscous.nominal),
        "reflected_inertia": armature,
    }


def reasons_against(robot: Robot, fitted: Fitted, j: int) -> list[str]:
    """Why the fit of a joint should not be trusted, in words; empty if nothing speaks against it."""
    found = []
    partner = fitted.couplings[j]
    if partner is not None:
        found.append(
            f"coupled with {robot.joints[partner.joint].name}, whose motion explains {partner.share:.0%} of what is "
            "left; a model joint by joint cannot"
        )
    ratio = fitted.judged[j].error.nrmse_low_passed
    where = "held-out" if fitted.test else "fitted"
    if ratio is None:
        found.append("no torque was recorded")
    elif ratio > UNEXPLAINED:
        found.append(f"{ratio:.0%} of the torque below the cut-off (RMS) is unexplained on the {where} part")
    return found


def gravity_text(fitted: Fitted, with_gravity: bool) -> str | None:
    """A sentence if the record and the option disagree about gravity, beyond what chance allows."""
    share = fitted.gravity
    if share is None:
        return None
    ends = " to ".join(f"{100.0 * end:.0f}" for end in share.interval)
    percent = f"{abs(round(100.0 * share.value)):d} % ({ends} %, 95 % interval)"
    if with_gravity and share.value < GRAVITY_MISSING and share.interval[1] < 1.0:
        return (
            f"gravity is missing: the recorded torque holds {percent} of the model's gravity; "
            "if it is commanded on top of a gravity compensation, say --effort net-torque"
        )
    if not with_gravity and share.value > 1.0 - GRAVITY_MISSING and share.interval[0] > 0.0:
        return f"gravity is in the record: it holds {percent} of the model's gravity; say --effort torque"
    return None
