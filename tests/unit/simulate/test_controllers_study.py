"""What [D] 2.6.4 finds, on shipped arms, motions and scenarios."""

from functools import cache

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.workflows.simulation_study import SimulateOptions, read_study, run_one
from tests.unit.simulate.arms import ROOT


@cache
def error(arm: str, motion: str, scenario: str) -> Array:
    """Norm of the position error at each sample of a whole run, shape (K,), [rad]."""
    files = {"assemblies": arm, "trajectories": motion, "scenarios": scenario}
    paths = [ROOT / folder / f"{name}.yaml" for folder, name in files.items()]
    run, _ = run_one(read_study(paths[0], paths[1], SimulateOptions(scenario=paths[2])), 0, lambda _: None)
    assert run.diverged is None
    return np.asarray(np.linalg.norm(run.recording.desired[:, 0] - run.recording.values["q"], axis=1))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_pid_goes_unstable_when_the_arm_is_rebuilt_and_model_based_control_does_not() -> None:
    """Figure 2.17."""
    short = {name: rms(error("lwa4p-6", "half-b1-6", name)) for name in ("pid-50", "id-50", "pb-afc-50")}
    long = {name: rms(error("lwa4p-6-tool", "half-b1-6", name)) for name in short}
    assert short["pid-50"] < 1.2 * short["id-50"]  # comparable where it was tuned
    assert long["pid-50"] > 8.0 * short["pid-50"]
    assert long["id-50"] < 1.1 * short["id-50"]
    assert long["pb-afc-50"] < 1.1 * short["pb-afc-50"]
    # unstable: the oscillation grows until the torque limits bound it
    parts = np.array_split(error("lwa4p-6-tool", "half-b1-6", "pid-50"), 9)
    assert parts[0].max() < 0.01
    assert max(part.max() for part in parts) > 0.04


def test_friction_is_learned_from_nothing() -> None:
    """Figure 2.16: the same motion twice."""
    first, second = np.array_split(error("lwa4p-6", "fourier-6", "pb-afc-zero-guess"), 2)
    assert rms(second) < 0.8 * rms(first)


def test_passivity_based_control_follows_closer() -> None:
    """Figure 2.14, one arm of it."""
    assert rms(error("lwa4p-6", "half-b1-6", "pb-42")) < rms(error("lwa4p-6", "half-b1-6", "id-35"))
