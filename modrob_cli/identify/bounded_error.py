r"""Bounded-error identification: the smallest intervals of friction, rotor and disturbance that explain all samples.

Per joint, with the rigid bodies' range [low, high] from their boxes, three answers to two questions:

* ``disturbance``: one value each for viscous friction, Coulomb friction and rotor inertia, and the smallest interval of
  the disturbance that puts every sample inside the torque bounds: the constant model with the least largest error.
* ``least``: intervals for all four; of all that put every sample inside, those with the smallest mean width of the
  bounds over the samples. The width of each interval counts by its mean effect on the torque (viscous: mean |dq|,
  Coulomb: 1, rotor: mean |ddq|, disturbance: 1), so no weights are made up: it goes where it saves most.
* ``consistent``: with a stated bound on the noise of the torque, the smallest box that holds **all** constant
  parameters which agree with every sample. If the bound holds and the model is right, it holds the true parameters. Its
  disturbance is the offset plus the noise, because what is compared with bounds later is a recorded torque again.

[S] V states that no scheme for such bounds was known. The first two are interval predictor models (Campi, Calafiore,
Garatti, Automatica 2009), the third is set-membership estimation (Milanese, Vicino, Automatica 1991).
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from modrob_cli.arrays import Array, Indices
from modrob_cli.identify.bounded_answers import Answers, Known
from modrob_cli.identify.bounded_programme import TOLERANCE, Active, form
from modrob_cli.identify.bounded_rounding import nearest, outward
from modrob_cli.identify.bounded_samples import ARMATURE, DISTURBANCE, PARAMETERS, JointSamples
from modrob_cli.interval import Interval

SLACK = 4.0
"""Times the solver's tolerance that is granted where the noise is just enough."""

Spread = Literal["disturbance", "least", "consistent"]

MORE = 0.1
"""``alternatives`` are the constant parameters that need at most this share more disturbance than the best ones."""

POINT = 1e-4
"""Intervals whose width changes the torque by less than this share of the largest one are written as one value."""


@dataclass(frozen=True)
class JointRequest:
    """What is asked for one joint.

    Attributes
    ----------
    spread : which answer; ``consistent`` falls back to ``least`` where no constant parameters agree with the noise
    noise : the recorded torque is known to +- this, >= 0
    outliers : at most so many samples may be left out
    own : ends of viscous, coulomb, armature that the robot has; kept where the samples do not tell them, shape (3, 2)
    gear_ratio : the rotor inertia is written at the motor, divided by its square
    moves : False if what looks like motion is noise
    details : False to leave out ``widths`` and ``alternatives``, which take most of the time
    """

    spread: Spread = "least"
    noise: float = 0.0
    outliers: int = 0
    own: Array = field(default_factory=lambda: np.zeros((3, 2)))
    gear_ratio: float = 1.0
    moves: bool = True
    details: bool = True


@dataclass(frozen=True)
class JointBounds:
    """Intervals of one joint, link side; viscous, coulomb, armature (rotor inertia at the joint), disturbance.

    Attributes
    ----------
    ends : lower and upper end of each, with few digits, shape (4, 2)
    rotor : the ends of the rotor inertia at the motor that are written, shape (2,), [kg m^2]; their product with the
        squared gear ratio, rounded outward, is the armature
    nominal : value of each, inside its interval, shape (4,); that of the disturbance is the offset
    spread : which answer it is
    agrees : True if constant parameters agree with the noise; None if no noise was stated
    least_disturbance : half-width that the best constant parameters need
    mean_width : of the torque bounds over the samples that count, rigid bodies included
    width_with_all : the least mean width if no sample were left out
    widths : the least mean width if only these parameters had an interval, by names joined by " + "
    alternatives : range of each among constant parameters with little more disturbance, shape (4, 2); the ends
        themselves without details
    kept : names of the parameters that the samples do not tell; they are the robot's own
    active : samples that decide;  left_out : samples that were left out; by index
    unknowns : number of ends that were free
    """

    ends: Array
    rotor: Array
    nominal: Array
    spread: Spread
    agrees: bool | None
    least_disturbance: float
    mean_width: float
    width_with_all: float
    widths: dict[str, float]
    alternatives: Array
    kept: tuple[str, ...]
    active: tuple[Active, ...]
    left_out: Indices
    unknowns: int


def bound_joint(samples: JointSamples, request: JointRequest) -> JointBounds:
    """Find the intervals of one joint.

    Ends are rounded outward to few digits, and the disturbance is closed over all samples by direct evaluation
    afterwards, so the promise "every sample that was not left out lies inside" does not rest on the solver.

    Raises
    ------
    NumericalError
        If the solver fails.
    """
    known = untold(samples, request)
    answers = Answers(samples, known, request.noise)
    driver = answers.sought if request.spread == "least" else frozenset({DISTURBANCE})
    with_all = samples.mean_width(answers.driver(driver).ends)
    left_out = answers.leave_out_worst(request.outliers, driver, _enough(request))
    counted = samples.picked(np.setdiff1d(np.arange(len(samples)), left_out)) if len(left_out) else samples
    centre = answers.one_value_each()
    need = 0.5 * float(centre.ends[-1] - centre.ends[-2])
    ends, active, spread = _found(answers, request, need)
    written, rotor = _rounded(counted, ends, spread, known, request.gear_ratio)
    low, high = _closing(counted, written, request.noise)
    if spread == "consistent":
        low, high = min(low, ends[DISTURBANCE, 0]), max(high, ends[DISTURBANCE, 1])
    written[DISTURBANCE] = outward(low, high)
    others = answers.consistent((1.0 + MORE) * need + SLACK * answers.slack) if request.details else None
    nominal = centre.ends.reshape(-1, 2).mean(axis=1) if spread == "consistent" else written.mean(axis=1)
    return JointBounds(
        ends=written,
        rotor=rotor,
        nominal=np.clip([nearest(value) for value in nominal], written[:, 0], written[:, 1]),
        spread=spread,
        agrees=need <= request.noise + SLACK * answers.slack if request.noise > 0.0 else None,
        least_disturbance=need,
        mean_width=counted.mean_width(written.ravel()),
        width_with_all=with_all,
        widths=answers.widths(request.noise) if request.details else {},
        alternatives=written if others is None else others[0],
        kept=tuple(PARAMETERS[k] for k in sorted(known)),
        active=active,
        left_out=left_out,
        unknowns=form(known, answers.sought if spread == "least" else {DISTURBANCE}).size,
    )


def _found(answers: Answers, request: JointRequest, need: float) -> tuple[Array, tuple[Active, ...], Spread]:
    """Ends (4, 2) before rounding, the samples that decide, and which answer it is."""
    if request.spread == "consistent" and need <= request.noise + SLACK * answers.slack:
        found = answers.consistent(request.noise + SLACK * answers.slack)
        if found is not None:
            ends, active = found
            ends[DISTURBANCE] += -request.noise, request.noise
            return ends, active, "consistent"
    if request.spread == "disturbance":
        answer = answers.one_value_each(request.noise)
    else:
        answer = answers.least_width(answers.sought, request.noise)
    # The solver may leave the ends of a point in the wrong order by its tolerance.
    ends = np.sort(answer.ends.reshape(-1, 2), axis=1)
    return ends, answer.active, "disturbance" if request.spread == "disturbance" else "least"


def _enough(request: JointRequest) -> float:
    """Disturbance down to which samples are left out: to explain the rest by the noise is enough."""
    return request.noise if request.spread == "consistent" else 0.0


def untold(samples: JointSamples, request: JointRequest) -> dict[int, tuple[float, float]]:
    """Parameters that the samples do not tell, with the robot's own ends.

    A joint that never moves says nothing of friction and rotor. In one direction only, Coulomb friction looks like an
    offset of the torque.
    """
    down, up = samples.moving()
    moves = request.moves and bool(down or up)
    told = (moves, moves and bool(down and up), moves and bool(np.any(samples.ddq)) and request.gear_ratio != 0.0)
    return {k: (float(request.own[k, 0]), float(request.own[k, 1])) for k in range(len(told)) if not told[k]}


def _rounded(
    samples: JointSamples, ends: Array, spread: Spread, known: Known, gear_ratio: float
) -> tuple[Array, Array]:
    """Ends of viscous, coulomb, armature with few digits, shape (4, 2), disturbance still 0; and of the rotor, (2,)."""
    effect = samples.reach()[::2]
    squared = Interval(gear_ratio) * gear_ratio
    out, rotor = np.zeros((len(PARAMETERS), 2)), np.zeros(2)
    for k in range(DISTURBANCE):
        if k in known:
            out[k] = known[k]
            continue
        found = Interval(ends[k, 0], ends[k, 1])
        point = spread != "consistent" and (ends[k, 1] - ends[k, 0]) * effect[k] <= POINT * samples.scale
        if k == ARMATURE:
            found = found / squared
        low, high = max(float(found.inf), 0.0), float(found.sup)
        out[k] = nearest(0.5 * (low + high)) if point else outward(low, high)
        if k == ARMATURE:
            rotor = out[k].copy()
            product = squared * Interval(*rotor)
            out[k] = product.inf, product.sup
    return out, rotor


def _closing(samples: JointSamples, ends: Array, noise: float) -> tuple[float, float]:
    """Interval of the disturbance that puts all these samples inside, given the other intervals; at least the noise."""
    lower, upper = samples.edges(ends.ravel())
    high = float(np.max(samples.least_upper() - upper))
    low = float(np.min(samples.most_lower() - lower))
    if low > high:  # the other intervals are wide enough
        low = high = 0.5 * (low + high)
    # Reserve for the rounding of what is computed from the file later: roll, pitch and yaw lose a few last digits.
    reserve = max(TOLERANCE * samples.scale, noise - 0.5 * (high - low))
    return low - reserve, high + reserve
