"""What a report shows of each joint: torque with its bounds; what is left over time, velocity and frequency."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from modrob_cli.arrays import Array
from modrob_cli.plot.svg_figure import FAINT, INK, ink, svg_text
from modrob_cli.plot.thinning import thin

RECORDED, PREDICTED, RESIDUAL, BAND, FITTED = "#8a8f94", "#1a73e8", "#d93025", "#1a73e8", "#188038"

_POINTS = 1500
"""Points of a curve: a page with many joints stays a few megabytes."""
_DOTS = 2500
_SEED = 1
_FLOOR = 1e-8
"""Power below this part of the largest is rounding and filters, not worth the scale."""


@dataclass(frozen=True)
class JointResiduals:
    """One joint of one log, N samples.

    Attributes
    ----------
    name, unit : of the joint and of its torque
    t : [s];  dq : [rad/s] or [m/s]
    recorded, predicted, lower, upper : torques
    used : samples that count; others are shaded
    """

    name: str
    unit: str
    velocity_unit: str
    t: Array
    dq: Array
    recorded: Array
    predicted: Array
    lower: Array
    upper: Array
    used: NDArray[np.bool_]

    @property
    def residual(self) -> Array:
        """Recorded less predicted torque."""
        return self.recorded - self.predicted


def residual_figure(joint: JointResiduals, name: str, band: str = "bounds of the model") -> str:
    """SVG of one joint; ``name`` is unique on the page, ``band`` says what lower and upper are."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 5.2))
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2, width_ratios=(2.2, 1.0))
    for axis in axes.flat:
        ink(axis)
    _draw_torque(axes[0, 0], joint, band)
    _draw_residual(axes[1, 0], joint)
    _draw_against_velocity(axes[0, 1], joint)
    _draw_spectrum(axes[1, 1], joint)
    figure.subplots_adjust(left=0.065, right=0.99, top=0.95, bottom=0.09, hspace=0.33, wspace=0.17)
    return svg_text(figure, name)


def _draw_torque(axis: Any, joint: JointResiduals, band: str) -> None:
    t, lower = thin(joint.t, joint.lower, _POINTS)
    upper = np.interp(t, *thin(joint.t, joint.upper, _POINTS))
    axis.fill_between(t, lower, upper, color=BAND, alpha=0.22, linewidth=0, label=band)
    axis.plot(*thin(joint.t, joint.recorded, _POINTS), color=RECORDED, linewidth=1.2, label="recorded")
    axis.plot(*thin(joint.t, joint.predicted, _POINTS), color=PREDICTED, linewidth=0.9, label="predicted")
    _shade(axis, joint)
    axis.set_ylabel(f"torque [{joint.unit}]", fontsize=9)
    place = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.98), "borderaxespad": 0.2}
    legend = axis.legend(**place, fontsize=8, frameon=False, ncols=3)
    # Names come from files: $ would start a formula.
    axis.set_title(joint.name.replace("$", r"\$"), loc="left", y=1.0, fontsize=10, fontweight="bold", color=INK)
    for text in legend.get_texts():
        text.set_color(INK)


def _draw_residual(axis: Any, joint: JointResiduals) -> None:
    axis.plot(*thin(joint.t, joint.residual, _POINTS), color=RESIDUAL, linewidth=0.8)
    axis.axhline(0.0, color=INK, linewidth=0.5)
    _shade(axis, joint)
    axis.set_ylabel(f"recorded - predicted [{joint.unit}]", fontsize=9)
    axis.set_xlabel("time [s]", fontsize=9)


def _draw_against_velocity(axis: Any, joint: JointResiduals) -> None:
    picked = np.flatnonzero(joint.used)
    if len(picked) > _DOTS:
        picked = np.sort(np.random.default_rng(_SEED).choice(picked, _DOTS, replace=False))
    axis.plot(joint.dq[picked], joint.residual[picked], ".", color=RESIDUAL, markersize=1.6, rasterized=True)
    axis.axhline(0.0, color=INK, linewidth=0.5)
    axis.set_xlabel(f"velocity [{joint.velocity_unit}]", fontsize=9)
    axis.set_ylabel(f"left over [{joint.unit}]", fontsize=9)


def _draw_spectrum(axis: Any, joint: JointResiduals) -> None:
    """Power density of what is left over; white noise is flat, what a better model could explain is not."""
    from scipy.signal import welch

    rate = (len(joint.t) - 1) / float(joint.t[-1] - joint.t[0])
    residual = joint.residual[joint.used]
    if len(residual) < 32:
        return
    frequency, power = welch(residual, rate, nperseg=min(len(residual), 2048))
    floor = _FLOOR * max(float(power.max()), 1e-300)
    axis.loglog(frequency[1:], np.maximum(power[1:], floor), color=RESIDUAL, linewidth=0.9)
    axis.set_xlabel("frequency [Hz]", fontsize=9)
    axis.set_ylabel(f"power [({joint.unit})²/Hz]", fontsize=9)


def _shade(axis: Any, joint: JointResiduals) -> None:
    """Grey the stretches of time that do not count."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], joint.used, [True]]).astype(int)))
    for start, end in edges.reshape(-1, 2):
        last = min(end, len(joint.t) - 1)
        axis.axvspan(joint.t[start], joint.t[last], color=FAINT, alpha=0.18, zorder=0, linewidth=0)
    axis.set_xlim(joint.t[0], joint.t[-1])
