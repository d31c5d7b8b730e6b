"""Width of the published interval bounds over that of the exact ones: ``python -m benchmarks.bounds_width``.

Per joint, the median over 1000 random states of the arm of [D] Table 3.4: q within +-pi, dq within +-1 rad/s, ddq
within +-3 rad/s^2, all uniform. The ratio depends on the states (the first joint, which carries no weight, most) and on
the frames in which the links' intervals are given; the published algorithm uses D-H frames.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.assembly.interval_published import published_intervals
from modrob_cli.assembly.interval_tight import tight_intervals
from modrob_cli.dynamics.exact_bounds import exact_bounds
from modrob_cli.dynamics.ianea import ianea
from modrob_cli.dynamics.ianea_links import LinkBoxes
from modrob_cli.interval import Interval
from modrob_cli.model.joint import Drive, Friction
from modrob_cli.model.robot import Robot
from modrob_cli.model.uncertain import Uncertain
from modrob_cli.workflows.robots import load_robot

ASSEMBLIES = Path(__file__).parents[1] / "assemblies"
STATES = 1000


def widened(robot: Robot, share: float) -> Robot:
    """The robot with every body parameter within +-share of its nominal value."""

    def widen(value: Uncertain) -> Uncertain:
        half = share * np.abs(value.nominal)
        return Uncertain(value.nominal, Interval(value.nominal - half, value.nominal + half))

    bodies = [
        replace(body, mass=widen(body.mass), com=widen(body.com), inertia=widen(body.inertia))
        for body in (placed.body for placed in robot.bodies)
    ]
    placed = tuple(replace(old, body=body) for old, body in zip(robot.bodies, bodies, strict=True))
    return replace(robot, bodies=placed)


def bodies_alone(robot: Robot) -> Robot:
    """The robot without friction, rotors and disturbance, whose widths are the same for both methods."""
    joints = tuple(replace(joint, friction=Friction(), drive=Drive()) for joint in robot.joints)
    return replace(robot, joints=joints, disturbance=Interval(np.zeros(robot.dof)))


def link_boxes(robot: Robot, frames: Array | None = None, published: bool = False) -> LinkBoxes:
    """Interval parameters of the links, tight or as published; in D-H frames if none are given."""
    frames = dh_table(robot).frames if frames is None else frames
    found = (published_intervals if published else tight_intervals)(robot, frames)
    return LinkBoxes(found.mass, found.com, found.inertia_com, frames)


def random_states(dof: int, seed: int = 1) -> tuple[Array, Array, Array]:
    """Random q, dq, ddq, shape (STATES, dof) each."""
    rng = np.random.default_rng(seed)
    q, dq, ddq = (rng.uniform(-most, most, (STATES, dof)) for most in (np.pi, 1.0, 3.0))
    return q, dq, ddq


def width_ratio(robot: Robot, links: LinkBoxes) -> Array:
    """Median of width of IANEA* over exact width, rigid bodies alone, shape (n,)."""
    robot = bodies_alone(robot)
    states = random_states(robot.dof)
    exact, published = exact_bounds(robot, *states), ianea(robot, *states, links)
    return np.asarray(np.median((published.upper - published.lower) / (exact.upper - exact.lower), axis=0))


def main() -> None:
    """Print the table."""
    arm = load_robot(ASSEMBLIES / "lwa4p-table34.yaml").robot
    tolerant = load_robot(ASSEMBLIES / "lwa4p-6-tol5.yaml").robot
    own = np.tile(np.eye(4), (arm.dof, 1, 1))
    print(f"{'IANEA* / exact, per joint':62}" + "".join(f"{name:>8}" for name in arm.joint_names))
    for title, robot in (
        ("uncertain last link", arm),
        ("+-10 % on everything", widened(arm, 0.1)),
        ("15 modules, +-5 % each", tolerant),
    ):
        for kind, links in (
            ("D-H frames", link_boxes(robot)),
            ("joint frames", link_boxes(robot, own)),
            ("D-H frames, published link intervals", link_boxes(robot, published=True)),
        ):
            ratios = "".join(f"{ratio:8.2f}" for ratio in width_ratio(robot, links))
            print(f"{title + '; ' + kind:62}{ratios}")


if __name__ == "__main__":
    main()
