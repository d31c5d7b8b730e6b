"""Pictures of an identification: friction, torques of the worst log, what the filter did."""

from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.regression_result import JointEstimate
from modrob_cli.identify.run import Run
from modrob_cli.identify.signal_cutoff import spectrum
from modrob_cli.model.joint import Joint
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.plot.friction import FrictionPanel, draw_friction
from modrob_cli.plot.signals import SignalPanel, draw_signals
from modrob_cli.plot.validation import TorquePicture, draw_torques
from modrob_cli.workflows.identify_fit import Fitted, predicted, scaled
from modrob_cli.workflows.identify_pooled import PooledRun, PooledRuns
from modrob_cli.workflows.identify_summary import unit

ZOOM = 12.0
"""Length of the zoom in periods of the cut-off frequency."""

MOST_POINTS = 200_000
"""Of more samples, evenly picked ones become points of the friction picture, which thins them further."""


def friction_panels(robot: Robot, pooled: PooledRuns, fitted: Fitted, confidence: float) -> list[FrictionPanel]:
    """Friction over velocity of each joint, all logs together."""
    train, test = scaled(pooled.train, fitted.estimates), scaled(pooled.test, fitted.estimates)
    step = 1 + sum(len(run.t) for run in train) // MOST_POINTS
    panels = []
    for j, joint in enumerate(robot.joints):
        estimate = fitted.estimates[j]
        points = _points(train, test, j, estimate, step)
        top = max((float(np.max(np.abs(x[:, 0]), initial=0.0)) for x in points), default=0.0) or 1.0
        dq = np.unique(np.concatenate([np.linspace(-top, top, 401), np.linspace(-1, 1, 101) * 5.0 * estimate.width]))
        dq = dq[np.abs(dq) <= top]
        load = np.concatenate([np.abs(run.tau_rigid[run.used, j]) for run in train])
        curve, half = estimate.curve(dq, float(np.mean(load)) if len(load) else 0.0, confidence)
        captions = _captions(joint, estimate)
        speed = "rad/s" if joint.type == "revolute" else "m/s"
        series = (points[0], points[1], dq, curve, half)
        panels.append(FrictionPanel(joint.name, unit(joint, "offset"), speed, captions, *series, estimate.rms))
    return panels


def draw_friction_of(robot: Robot, pooled: PooledRuns, panels: list[FrictionPanel], path: Path) -> None:
    """Picture of the friction of all joints."""
    logs = pooled.runs[0].train.name if len(pooled.runs) == 1 else f"{len(pooled.runs)} logs"
    subtitle = "recorded torque minus rigid bodies and rotor, low-passed; standstill left out"
    draw_friction(f"{robot.name}: friction from {logs}", subtitle, panels, path)


def _points(train: list[Run], test: list[Run], j: int, estimate: JointEstimate, step: int) -> tuple[Array, Array]:
    """Velocities and what is left for the friction, of both parts, shape (N, 2) each; every ``step``-th sample."""
    armature = estimate.model().get("reflected_inertia", 0.0)
    parts: tuple[list[Array], list[Array]] = ([np.empty((0, 2))], [np.empty((0, 2))])
    for fitted, held_out in zip(train, test, strict=True):
        left = fitted.filtered(fitted.tau[:, j] - fitted.tau_rigid[:, j] - armature * fitted.ddq[:, j])
        for found, run in zip(parts, (fitted, held_out), strict=True):
            shown = np.flatnonzero(run.used & (np.abs(run.dq[:, j]) > run.standstill[j]))[::step]
            found.append(np.column_stack([run.dq[shown, j], left[shown]]))
    return np.concatenate(parts[0]), np.concatenate(parts[1])


def _captions(joint: Joint, estimate: JointEstimate) -> tuple[str, ...]:
    texts = []
    for term in ("viscous", "coulomb", "offset"):
        found = estimate.estimates.get(term)
        if found is None:
            continue
        if found.value is None or found.interval is None:
            texts.append(f"{term} not excited")
        else:
            half = 0.5 * (found.interval[1] - found.interval[0])
            texts.append(f"{term} {found.value:.3g} +-{half:.2g} {unit(joint, term)}")
    return tuple(texts)


def draw_torques_of(robot: Robot, item: PooledRun, fitted: Fitted, path: Path) -> None:
    """Recorded and predicted torque of one log; the fitted and the held-out part are named in the title."""
    whole = scaled([item.whole], fitted.estimates)[0]
    units = tuple(unit(joint, "offset") for joint in robot.joints)
    errors = fitted.judged
    where = "held-out" if fitted.test else "fitted"
    captions = tuple(
        f"{where}: RMSE {found.error.rmse:.3g} {text}"
        + (f", NRMSE {found.error.nrmse:.3f}" if found.error.nrmse is not None else "")
        for found, text in zip(errors, units, strict=True)
    )
    held = np.flatnonzero(item.test.used)
    split = f"held out from {whole.t[held[0]]:.4g} s on" if len(held) else "all of it fitted"
    subtitle = f"rigid bodies + fitted terms; {split}; low-pass {whole.signals.cutoff:.3g} Hz; grey: not counted"
    series = (whole.t, whole.tau, predicted(whole, fitted.estimates), item.train.used | item.test.used)
    title = f"{robot.name}: {item.whole.name}"
    draw_torques(TorquePicture(title, subtitle, *series, robot.joint_names, units, captions), path)


def draw_filter_of(robot: Robot, item: PooledRun, log: JointLog, reason: str, path: Path) -> None:
    """What the low-pass did to one log, ``log`` being what was recorded."""
    run = item.whole
    raw = _recorded_velocity(log, run.t)
    rate, cutoff = run.signals.rate, run.signals.cutoff
    frequency, raw_density = spectrum(raw, rate)
    density = spectrum(run.dq, rate)[1]
    torque = run.filtered(run.tau)
    panels = []
    for j, joint in enumerate(robot.joints):
        fastest = int(np.argmax(np.where(run.used, np.abs(run.ddq[:, j]), -1.0)))
        reach = int(0.5 * ZOOM / cutoff * rate)
        part = slice(max(0, fastest - reach), fastest + reach + 1)
        speed = "rad/s" if joint.type == "revolute" else "m/s"
        series = (run.t[part], raw[part, j], run.dq[part, j], run.tau[part, j], torque[part, j])
        spectra = (frequency, raw_density[:, j], density[:, j])
        panels.append(SignalPanel(joint.name, speed, *spectra, *series, unit(joint, "offset")))
    kind = "as recorded" if log.dq is not None else "differences of the recorded positions"
    title = f"{robot.name}: what the low-pass at {cutoff:.4g} Hz did to {run.name}"
    draw_signals(title, f"velocity {kind}; cut-off: {reason}", cutoff, panels, path)


def _recorded_velocity(log: JointLog, t: Array) -> Array:
    """Velocity before the low-pass on even times, shape (N, n)."""
    raw = log.dq if log.dq is not None else np.gradient(log.q, log.t, axis=0)
    return np.stack([np.interp(t, log.t, column) for column in raw.T], axis=1)
