"""The shipped controllers by name."""

from collections.abc import Callable

from modrob_cli.errors import UsageError
from modrob_cli.simulate.controllers.classical_robust import ClassicalRobust
from modrob_cli.simulate.controllers.decentralised import FeedforwardPd, Pid
from modrob_cli.simulate.controllers.interface import Controller, ControlTask
from modrob_cli.simulate.controllers.interval_inverse_dynamics import IntervalInverseDynamics
from modrob_cli.simulate.controllers.interval_passivity import IntervalPassivityBased
from modrob_cli.simulate.controllers.inverse_dynamics import InverseDynamics
from modrob_cli.simulate.controllers.passivity import AdaptivePassivityBased, PassivityBased
from modrob_cli.simulate.controllers.r_alpha import RAlphaTracker

CONTROLLERS: dict[str, Callable[[ControlTask], Controller]] = {
    "feedforward-pd": FeedforwardPd,
    "pid": Pid,
    "id": InverseDynamics,
    "pb": PassivityBased,
    "pb-afc": AdaptivePassivityBased,
    "ia-id": IntervalInverseDynamics,
    "ia-pb": IntervalPassivityBased,
    "cr": ClassicalRobust,
    "r-alpha": RAlphaTracker,
}


def make_controller(name: str, task: ControlTask) -> Controller:
    """Make a shipped controller.

    Raises
    ------
    UsageError
        If there is none of that name, or its gains are wrong.
    """
    if name not in CONTROLLERS:
        raise UsageError(f"found the controller {name!r}, expected {', '.join(CONTROLLERS)} or a Python file")
    return CONTROLLERS[name](task)


def bounds_perturbation(name: str) -> bool:
    """Whether a shipped controller bounds its perturbation; see ``BoundsPerturbation``."""
    return name in ("ia-id", "ia-pb")
