"""Terms of the joint model that are fitted on top of the rigid bodies, as columns of a linear regression."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import UsageError

KINDS = ("viscous", "coulomb", "asymmetric", "stribeck", "load")
"""What ``--friction`` may name."""

NON_NEGATIVE = ("coulomb", "viscous", "reflected_inertia", "load")
"""Terms that cannot be negative in a passive joint."""


@dataclass(frozen=True)
class FrictionModel:
    """Which friction terms are fitted beside offset and reflected rotor inertia.

    Attributes
    ----------
    viscous : b dq
    coulomb : c sgn(dq)
    asymmetric : friction in each direction: a |dq| beside the viscous friction; another Coulomb friction in each
        direction is the offset, for while the joint moves the two are one and the same
    stribeck : s sgn(dq) exp(-(dq / v)^2), more friction at low speed; v is fitted too
    load : l sgn(dq) |rigid-body torque|, Coulomb friction that grows with the load
    """

    viscous: bool = True
    coulomb: bool = True
    asymmetric: bool = False
    stribeck: bool = False
    load: bool = False

    @classmethod
    def parse(cls, text: str) -> "FrictionModel":
        """Read a comma-separated list of :data:`KINDS`.

        Raises
        ------
        UsageError
            If a part is unknown or named twice, or a refinement comes without the term that it refines.
        """
        parts = [part.strip() for part in text.split(",")]
        unknown = [part for part in parts if part not in KINDS]
        if unknown or len(set(parts)) != len(parts):
            raise UsageError(
                f"--friction: found {text!r}, expected a list of {', '.join(KINDS)}, each at most once, such as "
                "viscous,coulomb,stribeck"
            )
        for refinement in ("stribeck", "load"):
            if refinement in parts and "coulomb" not in parts:
                raise UsageError(f"--friction: {refinement} refines coulomb; name coulomb too")
        if "asymmetric" in parts and not {"viscous", "coulomb"} & set(parts):
            raise UsageError("--friction: asymmetric refines viscous and coulomb; name one of them too")
        return cls(**{kind: kind in parts for kind in KINDS})

    @property
    def kinds(self) -> list[str]:
        """Names as ``--friction`` takes them."""
        return [kind for kind in KINDS if getattr(self, kind)]

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the columns in the order in which they are admitted: one that those before it imply is left out."""
        chosen = ["offset"]
        chosen += [term for term in ("coulomb", "viscous") if getattr(self, term)]
        chosen += ["reflected_inertia"]
        chosen += ["asymmetric"] if self.asymmetric and self.viscous else []
        chosen += [term for term in ("load", "stribeck") if getattr(self, term)]
        return tuple(chosen)


@dataclass(frozen=True)
class JointMotion:
    """What the columns of one joint are made of; N samples, link side.

    Attributes
    ----------
    dq, ddq : shape (N,), [rad/s] or [m/s] and derivative
    load : torque of the rigid bodies, shape (N,), [N m] or [N]
    """

    dq: Array
    ddq: Array
    load: Array


@dataclass(frozen=True)
class FrictionShape:
    """What enters the columns nonlinearly.

    Attributes
    ----------
    width : the sign of the velocity is tanh(dq / width), [rad/s] or [m/s], > 0; twice this velocity brings 96 %
    stribeck_velocity : [rad/s] or [m/s]; None without such a term
    """

    width: float
    stribeck_velocity: float | None = None


def columns(terms: Sequence[str], motion: JointMotion, shape: FrictionShape) -> Array:
    """Values of the terms per unit of their parameter, shape (N, terms).

    ``stribeck_slope`` is the derivative of ``stribeck`` with respect to its velocity, ``coulomb_slope`` that of
    ``coulomb`` with respect to the width of the transition.
    """
    sign = np.tanh(motion.dq / shape.width)
    parts: dict[str, Array] = {
        "offset": np.ones_like(motion.dq),
        "coulomb": sign,
        "coulomb_slope": -motion.dq / shape.width**2 * (1.0 - sign**2),
        "viscous": motion.dq,
        "reflected_inertia": motion.ddq,
        "asymmetric": np.abs(motion.dq),
        "load": sign * np.abs(motion.load),
    }
    if shape.stribeck_velocity is not None:
        ratio = (motion.dq / shape.stribeck_velocity) ** 2
        parts["stribeck"] = sign * np.exp(-ratio)
        parts["stribeck_slope"] = parts["stribeck"] * 2.0 * ratio / shape.stribeck_velocity
    return np.stack([parts[term] for term in terms], axis=1) if terms else np.empty((len(motion.dq), 0))
