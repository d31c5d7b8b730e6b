"""Base parameters from recordings: values, standard errors, and which link is to blame."""

from dataclasses import replace

import numpy as np
import pytest

from modrob_cli.errors import NumericalError, ShapeError
from modrob_cli.identify.base_columns import nominal_values
from modrob_cli.identify.base_correlation import bandwidth, critical_95, long_run_covariance
from modrob_cli.identify.base_estimate import estimate
from modrob_cli.identify.base_links import corrections, link_directions
from modrob_cli.identify.base_parameters import base_model
from modrob_cli.identify.base_report import base_parameter_report
from modrob_cli.identify.base_runs import TorqueRun
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.robots import load_robot
from tests.identification_data import COULOMB, VISCOUS, recording, with_scaled_mass
from tests.shared_data import shared


def shipped(name: str) -> Robot:
    return load_robot(shipped_folder("assemblies") / f"{name}.yaml").robot


def without_friction(robot: Robot) -> Robot:
    """Friction values of the file set to zero, rotors kept."""
    joints = tuple(replace(joint, friction=type(joint.friction)()) for joint in robot.joints)
    return replace(robot, joints=joints)


def test_without_noise_the_true_values_come_back() -> None:
    robot = without_friction(shipped("lwa4p-6"))
    true = with_scaled_mass(robot, 4, 1.3)
    model = base_model(robot)
    run = recording(true, np.random.default_rng(1), noise=0.0)
    fit = estimate(robot, model, [run])
    rigid = slice(0, 60)
    change = np.zeros(84)
    change[rigid] = (nominal_values(true) - nominal_values(robot))[rigid]
    wanted = model.base(change)
    kinds = [column.kind for column in model.representatives]
    chosen = [k for k, kind in enumerate(kinds) if kind not in ("coulomb", "viscous")]
    # Condition about 30, torques of 100 N m to 1e-14.
    np.testing.assert_allclose(fit.deviation[chosen], wanted[chosen], rtol=0, atol=1e-9)
    for kind, known in (("coulomb", COULOMB), ("viscous", VISCOUS)):
        friction = fit.deviation[[k for k, own in enumerate(kinds) if own == kind]]
        np.testing.assert_allclose(friction, known[:6], rtol=0, atol=1e-9)


def test_standard_errors_hold_under_correlated_residuals() -> None:
    """95 % intervals of all parameters over 60 runs; independent of the method: simply counted."""
    robot = without_friction(shipped("planar-2r"))
    model = base_model(robot)
    kept = [k for k, column in enumerate(model.representatives) if column.kind not in ("coulomb", "viscous")]
    z = []
    for seed in range(60):
        fit = estimate(robot, model, [recording(robot, np.random.default_rng(seed), noise=0.03)])
        z.append(fit.deviation[kept] / fit.stderr[kept] / fit.critical)
    inside = np.mean(np.abs(z) < 1.0)
    # 60 runs of 9 parameters that are correlated: +-3 %; the long-run variance is known to 10 % only.
    assert 0.88 <= inside <= 0.99
    # Errors that take residuals as independent would be four times too small: sqrt((1 + 0.9) / (1 - 0.9)).
    assert 2.0 < np.sqrt(fit.inflation) < 6.0


def test_bartlett_sum_equals_its_definition() -> None:
    rng = np.random.default_rng(5)
    s = rng.normal(size=(40, 3))
    for width in (1, 2, 7, 39, 40, 100):
        w = min(width, 40)
        lag = np.abs(np.subtract.outer(np.arange(40), np.arange(40)))
        wanted = s.T @ np.maximum(1.0 - lag / w, 0.0) @ s
        np.testing.assert_allclose(long_run_covariance(s, width), wanted, rtol=1e-12, atol=1e-12)


def test_a_slow_error_below_fast_noise_is_noticed() -> None:
    rng = np.random.default_rng(2)
    fast = rng.normal(size=(20_000, 1))
    slow = np.repeat(rng.normal(size=(200, 1)), 100, axis=0)
    assert bandwidth([fast], [0.01]) < 0.2
    assert bandwidth([fast + 0.3 * slow], [0.01]) > 1.0


def test_intervals_widen_with_the_kernel() -> None:
    """For a kernel over all samples the exact value is 4.771 (Abadir and Paruolo 1997); the formula is 1 % off."""
    assert critical_95(0.0) == 1.96
    assert critical_95(1.0) == pytest.approx(4.771, rel=0.02)


@pytest.mark.parametrize("link", [2, 3, 4, 5, 6])
def test_the_link_with_a_wrong_mass_is_named_lwa4p(link: int) -> None:
    robot = shipped("lwa4p-6")
    run = recording(with_scaled_mass(robot, link, 1.2), np.random.default_rng(10 + link), noise=0.01, duration=60.0)
    report = base_parameter_report(robot, [run], physical=False)
    first = report.suspects[0]
    assert link in (first.correction.link, *first.rivals)
    if link != 2:  # its mass hardly matters but where link 3's does the same; the report says so
        assert first.correction.link == link
        assert first.correction.kind == "mass"
        assert first.correction.mass_factor == pytest.approx(1.2, abs=0.02)
        assert f"link {link} (behind {robot.joints[link - 1].name}): mass off by +" in first.text
        assert first.correction.share > 0.9
    assert report.silent == (1,)
    assert "link 1" in report.notes[0]


@pytest.mark.parametrize("link", [2, 3, 4, 5, 6])
def test_the_link_with_a_wrong_mass_is_named_ur10(link: int) -> None:
    robot = load_robot(shared("ur10/model.urdf")).robot
    run = recording(with_scaled_mass(robot, link, 1.2), np.random.default_rng(20 + link), noise=0.01, duration=60.0)
    first = base_parameter_report(robot, [run], physical=False).suspects[0]
    assert (first.correction.link, first.correction.kind) == (link, "mass")
    # Link 6 weighs 0.2 kg of 33 kg.
    assert first.correction.mass_factor == pytest.approx(1.2, abs=0.08 if link == 6 else 0.02)


def test_nobody_is_blamed_for_noise_and_friction() -> None:
    robot = shipped("lwa4p-6")
    for seed in range(4):
        run = recording(robot, np.random.default_rng(seed), noise=0.03)
        report = base_parameter_report(robot, [run], physical=False)
        assert report.suspects == ()
        distances = [item.distance for item in report.parameters if item.is_rigid and item.distance is not None]
        assert np.median(np.abs(distances)) < 1.5


def test_two_wrong_links() -> None:
    robot = shipped("lwa4p-6")
    true = with_scaled_mass(with_scaled_mass(robot, 3, 1.2), 6, 0.8)
    run = recording(true, np.random.default_rng(3), noise=0.005, duration=60.0)
    found = base_parameter_report(robot, [run], physical=False).suspects
    assert {item.correction.link: round(item.correction.mass_factor or 0.0, 1) for item in found} == {3: 1.2, 6: 0.8}


def test_mass_direction_is_what_a_heavier_body_adds() -> None:
    robot = load_robot(shipped_folder("assemblies") / "scara.yaml").robot
    for link in range(1, 5):
        change = nominal_values(with_scaled_mass(robot, link, 1.5)) - nominal_values(robot)
        # Bodies of one link share one factor here; their tensors are about their own centres of mass.
        if len([placed for placed in robot.bodies_of(link) if placed.body.mass.nominal > 0.0]) == 1:
            direction = link_directions(robot, link)["mass"][:, 0]
            np.testing.assert_allclose(change[10 * link - 10 : 10 * link], 0.5 * direction, atol=1e-12)


def test_a_noisy_joint_does_not_spoil_the_others() -> None:
    robot = without_friction(shipped("planar-2r"))
    run = recording(robot, np.random.default_rng(4), noise=0.01)
    model = base_model(robot)
    tau = run.tau.copy()
    tau[:, 0] += 300.0 * np.random.default_rng(5).normal(size=len(tau))
    spoiled, clean = (estimate(robot, model, [item]) for item in (replace(run, tau=tau), run))
    second = [k for k, column in enumerate(model.representatives) if column.name in ("mc_x2", "mc_y2")]
    assert (np.abs(spoiled.deviation[second]) < 5.0 * clean.stderr[second] + 0.05).all()
    assert spoiled.sigma[0] == pytest.approx(300.0, rel=0.1)
    assert spoiled.sigma[1] == pytest.approx(clean.sigma[1], rel=0.1)


def test_what_does_not_move_is_not_guessed() -> None:
    robot = shipped("planar-2r")
    run = recording(robot, np.random.default_rng(6), noise=0.01)
    still = replace(
        run, q=run.q * [0.0, 1.0], dq=run.dq * [0.0, 1.0], ddq=run.ddq * [0.0, 1.0], use=run.use & [False, True]
    )
    report = base_parameter_report(robot, [still])
    values = {item.name: item.value for item in report.parameters}
    assert values["coulomb1"] is values["viscous1"] is values["I_zz1"] is None
    assert values["mc_x2"] is not None
    assert any("not excited" in note and "I_zz1" in note for note in report.notes)
    assert any("without usable samples: q1" in note for note in report.notes)


def test_without_gravity() -> None:
    """Recordings without gravity (as some drives report them) leave the static part out of the model."""
    robot = replace(shipped("planar-2r"), gravity=np.zeros(3))
    run = recording(robot, np.random.default_rng(7), noise=0.01)
    report = base_parameter_report(shipped("planar-2r"), [run], gravity=False)
    assert report.suspects == ()
    assert report.model.rigid_count == 4  # the two moments mc_x1, mc_y1 need gravity... and the rest inertia
    np.testing.assert_array_less(report.sigma_fitted, report.sigma)


def test_several_runs_count_together() -> None:
    robot = shipped("planar-2r")
    model = base_model(robot)
    runs = [recording(robot, np.random.default_rng(seed), noise=0.02, duration=20.0) for seed in (1, 2, 3, 4)]
    alone, together = estimate(robot, model, runs[:1]), estimate(robot, model, runs)
    assert together.samples.sum() > 3.5 * alone.samples.sum()
    # Half as large on average; the motions differ.
    assert np.median(together.stderr / alone.stderr) < 0.8


def test_hostile_recordings() -> None:
    robot = shipped("planar-2r")
    run = recording(robot, np.random.default_rng(8), noise=0.01)
    with pytest.raises(NumericalError, match="usable samples for"):
        base_parameter_report(robot, [replace(run, use=np.arange(len(run.t)) < 5)])
    with pytest.raises(NumericalError, match="usable samples for"):
        base_parameter_report(robot, [])
    with pytest.raises(NumericalError, match="not finite"):
        base_parameter_report(robot, [replace(run, tau=run.tau * np.nan)])
    with pytest.raises(ShapeError, match="one shape"):
        replace(run, tau=run.tau[:-1])
    with pytest.raises(ShapeError, match="mask"):
        replace(run, use=np.ones((3, 2), dtype=bool))
    with pytest.raises(ShapeError):
        base_parameter_report(shipped("lwa4p-6"), [run])
    hidden = np.where(run.use, run.tau, np.nan)  # what does not count may be anything
    assert np.isfinite(base_parameter_report(robot, [replace(run, tau=hidden)], physical=False).sigma).all()


def test_ranking_is_complete() -> None:
    robot = shipped("lwa4p-6")
    run = recording(robot, np.random.default_rng(9), noise=0.01)
    model = base_model(robot)
    tried = corrections(robot, model, estimate(robot, model, [run]))
    assert len(tried) == 4 * robot.dof
    assert {item.link for item in tried if item.size == 0} <= {1}
    assert all(0.0 <= item.explained <= 1.0 for item in tried)


def test_run_is_thinned_evenly() -> None:
    t = np.arange(10.0)
    x = np.arange(20.0).reshape(10, 2)
    run = TorqueRun("a", t, x, x, x, x, np.ones(10, dtype=bool)).every(3)
    assert run.t.tolist() == [0.0, 3.0, 6.0, 9.0]
    assert run.use.shape == (4, 2)
