"""What recordings say about the rigid bodies of a robot: base parameters, their errors, and whose data are wrong."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.identify.base_columns import nominal_values
from modrob_cli.identify.base_estimate import BaseEstimate, estimate
from modrob_cli.identify.base_grouping import TOLERANCE
from modrob_cli.identify.base_links import KINDS, Correction, corrections
from modrob_cli.identify.base_parameters import BaseModel, base_model
from modrob_cli.identify.base_runs import TorqueRun
from modrob_cli.identify.physical_fit import PhysicalFit, physical_fit
from modrob_cli.model.robot import Robot

STRONG = 10.0
"""Evidence from here on is strong, and so is a lead by this much (R. Kass, A. Raftery, JASA 90 (1995), section 3.2)."""

_WORTH_NAMING = 0.02
"""A further correction must explain this share of what rigid-body parameters can explain at first."""


@dataclass(frozen=True)
class BaseParameter:
    """One base parameter; SI units, link frames as in the robot file.

    Attributes
    ----------
    name : the standard parameter that stands for the group;  formula : the whole group;  unit : as text
    nominal : value that the robot file gives;  value : estimate, None if the motion does not excite it
    stderr : standard error of the estimate under correlated residuals;  interval : 95 %
    distance : (value - nominal) / stderr
    """

    name: str
    formula: str
    unit: str
    is_rigid: bool
    nominal: float
    value: float | None
    stderr: float | None
    interval: tuple[float, float] | None
    distance: float | None


@dataclass(frozen=True)
class Suspect:
    """A link whose data seem wrong.

    Attributes
    ----------
    correction : what would mend them;  name : of the link for people
    rivals : other links that would explain the data about as well
    after : how many suspects were found, and mended, before
    """

    correction: Correction
    name: str
    rivals: tuple[int, ...]
    after: int = 0

    @property
    def text(self) -> str:
        """A sentence for people."""
        fix, still = self.correction, " still" if self.after else ""
        share = f"explains {fix.share:.0%} of what rigid bodies can{still} explain"
        if fix.kind == "mass" and fix.mass_factor is not None and fix.mass_stderr is not None:
            off = f"mass off by {100.0 * (fix.mass_factor - 1.0):+.1f} % (+-{196.0 * fix.mass_stderr:.1f} %)"
        else:
            words = {"first moment": "centre of mass", "inertia": "inertia tensor"}
            off = f"{words.get(fix.kind, 'mass, centre of mass or inertia')} off"
        others = f"; it may as well be link {' or '.join(map(str, self.rivals))}" if self.rivals else ""
        return f"{self.name}: {off}, {share} ({fix.explained:.0%} of the residual){others}"


@dataclass(frozen=True)
class BaseParameterReport:
    """Everything about the base parameters of one robot.

    Attributes
    ----------
    model : base parameters and their formulas;  fit : the estimate
    parameters : p of them
    sigma, sigma_fitted : standard deviation of each joint's residual as the robot file predicts, and after the fit,
        (n,), [N m] or [N]
    suspects : links whose data are wrong, the worst first; each is found with those before it mended
    ranking : all single-link corrections, the best first
    silent : links of which no torque depends on the mass
    physical : standard parameters that real bodies can have, None if not asked for
    notes : in words
    """

    model: BaseModel
    fit: BaseEstimate
    parameters: tuple[BaseParameter, ...]
    sigma: Array
    sigma_fitted: Array
    suspects: tuple[Suspect, ...]
    ranking: tuple[Correction, ...]
    silent: tuple[int, ...]
    physical: PhysicalFit | None
    notes: tuple[str, ...]


def base_parameter_report(
    robot: Robot, runs: Sequence[TorqueRun], tolerance: float = TOLERANCE, physical: bool = True, gravity: bool = True
) -> BaseParameterReport:
    """Estimate base parameters from recordings and tell which link's data are wrong.

    Parameters
    ----------
    runs : recordings of the robot without contact
    tolerance : of the base parameters, see :func:`modrob_cli.identify.base_parameters.base_model`
    physical : also find standard parameters that real bodies can have
    gravity : False if the recorded torque is without that of gravity

    Raises
    ------
    NumericalError
        If there are too few usable samples, or values are not finite.
    ShapeError
        If a recording has another number of joints.
    """
    if not gravity:
        robot = replace(robot, gravity=np.zeros(3))
    model = base_model(robot, tolerance)
    fit = estimate(robot, model, runs)
    ranking = tuple(corrections(robot, model, fit))
    silent = tuple(sorted(item.link for item in ranking if item.kind == "mass" and not item.size))
    return BaseParameterReport(
        model,
        fit,
        _parameters(robot, model, fit),
        fit.sigma_before,
        fit.sigma,
        _suspects(robot, model, fit),
        ranking,
        silent,
        physical_fit(robot, model, fit) if physical else None,
        tuple(_notes(robot, model, fit, silent)),
    )


def _parameters(robot: Robot, model: BaseModel, fit: BaseEstimate) -> tuple[BaseParameter, ...]:
    nominal = model.base(nominal_values(robot))
    out = []
    for k, column in enumerate(model.representatives):
        value = stderr = interval = distance = None
        if fit.excited[k]:
            value, stderr = float(nominal[k] + fit.deviation[k]), float(fit.stderr[k])
            interval = (value - fit.critical * stderr, value + fit.critical * stderr)
            distance = float(fit.deviation[k] / stderr) if stderr > 0.0 else None
        name, formula = column.name, model.formula(k)
        out.append(
            BaseParameter(
                name, formula, column.unit, column.is_rigid, float(nominal[k]), value, stderr, interval, distance
            )
        )
    return tuple(out)


def _suspects(robot: Robot, model: BaseModel, fit: BaseEstimate) -> tuple[Suspect, ...]:
    """The set of corrections with the most evidence, out of three searches.

    Two wrong masses may look like one link that is wrong in everything, so that search is tried with simple corrections
    alone too.
    """
    tries = [_search(robot, model, fit, kinds) for kinds in (KINDS[:1], KINDS[:2], KINDS)]
    best = max(tries, key=lambda found: sum(suspect.correction.evidence for suspect in found))
    return tuple(best)


def _search(robot: Robot, model: BaseModel, fit: BaseEstimate, kinds: tuple[str, ...]) -> list[Suspect]:
    """Name corrections one after the other, each with those before it free, as long as the next one is worth it."""
    found: list[Suspect] = []
    whole: float | None = None
    while len(found) < robot.dof:
        accepted = [suspect.correction for suspect in found]
        tried = [item for item in corrections(robot, model, fit, accepted) if item.size and _possible(item)]
        chosen = [item for item in tried if item.kind in kinds]
        if not chosen or chosen[0].evidence < STRONG:
            break
        best = chosen[0]
        whole = best.gain / best.share if whole is None else whole
        if best.gain < _WORTH_NAMING * whole:
            break
        close = {item.link for item in tried if item.evidence > best.evidence - STRONG} - {best.link}
        found.append(Suspect(best, link_name(robot, best.link), tuple(sorted(close | set(best.alike))), len(found)))
    return found


def _possible(item: Correction) -> bool:
    """Whether a mass stays positive."""
    return item.mass_factor is None or item.mass_factor > 0.0


def link_name(robot: Robot, link: int) -> str:
    """Such as ``link 4 (behind PB2.2)``."""
    return f"link {link} (behind {robot.joints[link - 1].name})"


def _notes(robot: Robot, model: BaseModel, fit: BaseEstimate, silent: tuple[int, ...]) -> list[str]:
    out = [f"{link_name(robot, link)}: no torque depends on its mass, so it cannot be judged" for link in silent]
    missing = [column.name for column, seen in zip(model.representatives, fit.excited, strict=True) if not seen]
    if missing:
        out.append(f"not excited by the motion, kept as in the robot file: {', '.join(missing)}")
    idle = [joint.name for joint, count in zip(robot.joints, fit.samples, strict=True) if not count]
    if idle:
        out.append(f"without usable samples: {', '.join(idle)}")
    if not model.grouping.is_clear:
        kept, dropped = model.grouping.kept, model.grouping.dropped
        out.append(
            f"the number of base parameters depends on the tolerance: shares kept {kept:.1e}, dropped {dropped:.1e}"
        )
    if fit.condition > 100.0:
        out.append(f"condition number {fit.condition:.0f}, above 100: the motion tells some parameters badly apart")
    return out
