"""The picture of an arm: isometric, front and top view with joints, links, masses and frames."""

import math

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.robot import Robot
from modrob_cli.plot.scene import Disc, Label, Panel, Picture, Shape, Stroke

LINK_COLORS = ("#4c78a8", "#f58518", "#54a24b", "#b279a2", "#9d755d", "#e45756", "#72b7b2", "#eeca3b")
_AXES = (("x", "#d62728"), ("y", "#2ca02c"), ("z", "#1f77b4"))
_ON_TOP = 1e6
_LEGEND = (
    "bars: joint axes (black revolute, violet prismatic); discs: masses, area in proportion; "
    "frames: x red, y green, z blue"
)
_REVOLUTE, _PRISMATIC, _MASS = "#222222", "#7a1fa2", "#111111"


def _view(azimuth: float, elevation: float) -> Array:
    """Rows: right, up and towards the viewer, in the base frame; angles in degrees."""
    a, e = math.radians(azimuth), math.radians(elevation)
    right = (-math.sin(a), math.cos(a), 0.0)
    up = (-math.cos(a) * math.sin(e), -math.sin(a) * math.sin(e), math.cos(e))
    towards = (math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e))
    return np.array([right, up, towards])


def arm_picture(robot: Robot, q: Array, paths: list[Array]) -> Picture:
    """Draw a robot at joint positions q, shape (n,).

    ``paths`` are polylines (k, 3) of links 0..n in their link frames, drawn in one colour each; joints are short bars
    along their axes (black: revolute, violet: prismatic), discs the centres of mass with an area in proportion to the
    mass. The base and end-effector frames are shown as red x, green y and blue z.
    """
    frames = robot.link_frames(q)
    carriers = np.concatenate([np.eye(4)[None], frames[:-1]])
    lines = [path @ T[:3, :3].T + T[:3, 3] for path, T in zip(paths, carriers, strict=True)]
    masses = _mass_points(robot, frames)
    extent = np.concatenate([*lines, masses[0]])
    size = float(max(np.ptp(extent, axis=0).max(), 0.1))
    views = (
        (_view(35.0, 25.0), "isometric"),
        (_view(-90.0, 0.0), "front (x right, z up)"),
        (_view(-90.0, 90.0), "top"),
    )
    places = ((16.0, 76.0, 520.0, 508.0), (552.0, 76.0, 332.0, 246.0), (552.0, 338.0, 332.0, 246.0))
    panels = []
    for (view, title), place in zip(views, places, strict=True):
        panel = Panel(*place, title)
        panel.shapes = _shapes(robot, view, lines, frames, masses, size, labels=title == "isometric")
        _fit(panel, extent @ view[:2].T, size)
        panels.append(panel)
    total = sum(float(placed.body.mass.nominal) for placed in robot.bodies)
    tip = ", ".join(f"{value:.3f}" for value in frames[-1, :3, 3])
    angles = ", ".join(f"{value:.3g}" for value in q)
    notes = [
        f"{robot.dof} joints, {total:.2f} kg; end effector at ({tip}) m; q = ({angles})",
        _LEGEND,
    ]
    return Picture(900.0, 600.0, robot.name, notes, panels)


def _mass_points(robot: Robot, frames: Array) -> tuple[Array, Array]:
    """Centres of mass (k, 3) in the base frame and masses (k,) of the bodies that have mass."""
    carried = [placed for placed in robot.bodies if placed.body.mass.nominal > 0.0]
    if not carried:
        return np.zeros((0, 3)), np.zeros(0)
    poses = [(frames[p.link - 1] if p.link else np.eye(4)) @ p.pose for p in carried]
    centres = [T[:3, :3] @ p.body.com.nominal + T[:3, 3] for T, p in zip(poses, carried, strict=True)]
    return np.stack(centres), np.array([float(placed.body.mass.nominal) for placed in carried])


def _shapes(
    robot: Robot, view: Array, lines: list[Array], frames: Array, masses: tuple[Array, Array], size: float, labels: bool
) -> list[Shape]:
    shapes: list[Shape] = []
    wide = 12.0 if labels else 7.0
    for i, line in enumerate(lines):
        color = "#8c8c8c" if i == 0 else LINK_COLORS[(i - 1) % len(LINK_COLORS)]
        turned = line @ view.T
        depth = float(turned[:, 2].mean())
        shapes += [Stroke(turned[:, :2], wide + 2.5, "#ffffff", depth), Stroke(turned[:, :2], wide, color, depth)]
    for i, joint in enumerate(robot.joints):
        T = frames[i]
        bar = (T[:3, 3] + np.outer([-0.04, 0.04], T[:3, 2]) * size) @ view.T
        color = _REVOLUTE if joint.type == "revolute" else _PRISMATIC
        depth = float(bar[:, 2].mean()) + 0.02 * size
        shapes += [Stroke(bar[:, :2], wide + 5.0, "#ffffff", depth), Stroke(bar[:, :2], wide + 2.0, color, depth)]
        if labels:
            shapes.append(Label(bar.mean(axis=0)[:2], joint.name, (12.0, -8.0 - 12.0 * _stacked(frames, i))))
    heaviest = masses[1].max(initial=1e-9)
    for centre, mass in zip(*masses, strict=True):
        at = centre @ view.T
        radius = (1.5 + 6.5 * math.sqrt(mass / heaviest)) * (1.0 if labels else 0.6)
        shapes.append(Disc(at[:2], radius, "#ffffffb0", _MASS, _ON_TOP))
    for T, name in ((np.eye(4), "base"), (frames[-1], "end effector")):
        shapes += _triad(T, view, 0.1 * size, name if labels else "")
    return shapes


def _stacked(frames: Array, i: int) -> int:
    """How many joints before joint i sit at the same point (their labels are moved apart)."""
    same = [k for k in range(i) if np.allclose(frames[k, :3, 3], frames[i, :3, 3], atol=1e-6)]
    return len(same)


def _triad(T: Array, view: Array, length: float, name: str) -> list[Shape]:
    origin = T[:3, 3] @ view.T
    shapes: list[Shape] = []
    for axis, (_, color) in enumerate(_AXES):
        tip = (T[:3, 3] + length * T[:3, axis]) @ view.T
        depth = float(0.5 * (origin[2] + tip[2])) + length
        shapes.append(Stroke(np.stack([origin[:2], tip[:2]]), 2.5, color, depth))
    if name:
        shapes.append(Label(origin[:2], name, (-6.0, 18.0), "#777777", 10.0))
    return shapes


def _fit(panel: Panel, cloud: Array, size: float) -> None:
    """Map panel units (m) to pixels, the same scale on both axes, with a margin for labels; adds a scale bar.

    ``cloud`` are the points (k, 2) that have to be inside.
    """
    low, high = cloud.min(axis=0) - 0.14 * size, cloud.max(axis=0) + 0.14 * size
    scale = min((panel.width - 24.0) / (high[0] - low[0]), (panel.height - 44.0) / (high[1] - low[1]))
    middle = 0.5 * (low + high)
    centre = np.array([panel.left + 0.5 * panel.width, panel.top + 0.5 * panel.height + 6.0])

    def pixels(points: Array) -> Array:
        return np.asarray(centre + (points - middle) * [scale, -scale])

    moved: list[Shape] = []
    for shape in panel.shapes:
        if isinstance(shape, Stroke):
            moved.append(Stroke(pixels(shape.points), shape.width, shape.color, shape.depth))
        elif isinstance(shape, Disc):
            moved.append(Disc(pixels(shape.centre), shape.radius, shape.fill, shape.edge, shape.depth))
        else:
            moved.append(Label(pixels(shape.anchor), shape.text, shape.offset, shape.color, shape.size, shape.depth))
    length = _round_length(0.25 * size)
    corner = np.array([panel.left + 14.0, panel.top + panel.height - 14.0])
    moved.append(Stroke(np.stack([corner, corner + [length * scale, 0.0]]), 2.0, "#555555", 1e8))
    moved.append(Label(corner, f"{length:g} m", (0.0, -5.0), "#555555", 10.0))
    panel.shapes = moved


def _round_length(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above the length."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length * 1.0000001)
