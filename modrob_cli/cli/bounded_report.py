"""What ``modrob identify --bounds`` says on the terminal."""

from collections.abc import Iterator
from typing import Any

from modrob_cli.cli.console import say, table

_ANSWERS = {"disturbance": "one value", "least": "least width", "consistent": "all consistent"}
_SHOWN = 3

Json = dict[str, Any]


def say_bounds(bounds: Json) -> None:
    """Print the intervals, how they fare on held-out samples, what was left out, and what would do instead."""
    say("\n  smallest intervals that put every sample inside the torque bounds (bounded error)\n")
    header = ("joint", "answer", "viscous", "Coulomb", "rotor at joint", "disturbance", "mean width")
    say(table((*header, "inside", "held out", "unit"), [_row(bounds, j) for j in range(len(bounds["joints"]))]))
    say("  inside: share of the samples that were used; held out: of those that were not")
    for text in _lines(bounds):
        say(f"  {text}")


def _row(bounds: Json, j: int) -> tuple[object, ...]:
    joint, held = bounds["joints"][j], bounds["held_out"]
    keys = ("viscous", "coulomb", "reflected_inertia", "disturbance")
    share = f"{held['joints'][j]['inside']:.1%}" if held else "-"
    width = float(f"{joint['mean_width']:.3g}")
    intervals = [_interval(joint[key]) for key in keys]
    return (joint["name"], _ANSWERS[joint["spread"]], *intervals, width, f"{joint['inside']:.2%}", share, joint["unit"])


def _interval(value: Json) -> str:
    low, high = f"{value['lower']:.4g}", f"{value['upper']:.4g}"
    return low if low == high else f"{low} .. {high}"


def _lines(bounds: Json) -> Iterator[str]:
    for joint in bounds["joints"]:
        name = joint["name"]
        yield from _left_out(joint)
        promise = joint["reliability"]
        if promise is not None and promise["outside_at_most"] < 0.5:
            yield (
                f"{name}: at most {promise['outside_at_most']:.1%} of more of the same motion should fall outside "
                f"({promise['confidence']:.0%} confidence, {promise['independent_samples']:.0f} independent samples)"
            )
        yield from (f"note: {name}: {note}" for note in joint["notes"])
    yield from _growth(bounds["growth"])
    for item in (bounds["overlay"] or {}).get("joined", []):
        joints = ", ".join(item["joints"])
        yield f"note: module {item['module']}, unit {item['unit']}, holds the intervals of all its uses: {joints}"


def _left_out(joint: Json) -> Iterator[str]:
    events = sorted(joint["left_out"], key=lambda event: -event["samples"])
    if not events:
        return
    count = sum(event["samples"] for event in events)
    shown = [
        f"{event['log']} {event['start']:.3f} .. {event['end']:.3f} s ({event['samples']}, up to {event['peak']:.3g} "
        f"{joint['unit']} outside)"
        for event in events[:_SHOWN]
    ]
    more = f"; and {len(events) - _SHOWN} more" if len(events) > _SHOWN else ""
    widths = f"mean width {joint['mean_width_with_all']:.3g} -> {joint['mean_width']:.3g} {joint['unit']}"
    yield f"{joint['name']}: {count} samples left out, {widths}: {'; '.join(shown)}{more}"


def _growth(growth: Json | None) -> Iterator[str]:
    """Growth of the rigid bodies' boxes that would take over from the disturbance."""
    if growth is None:
        return
    if growth["box_factor"] is not None:
        yield f"rigid bodies: boxes {growth['box_factor']:.3g} times as large would bring disturbances to their targets"
    for joint in growth["joints"]:
        found = {name: share for name, share in joint["one_mass"].items() if share is not None}
        if joint["all_masses"] is None and not found:
            continue
        best = sorted(found, key=lambda name: found[name])[:_SHOWN]
        ways = [f"all +-{joint['all_masses']:.1%}"] if joint["all_masses"] is not None else []
        ways += [f"{name} alone +-{found[name]:.1%}" for name in best]
        target = f"from +-{joint['disturbance']:.3g} to +-{joint['target']:.3g}"
        yield f"{joint['name']}: masses that would bring the disturbance {target}: {', or '.join(ways)}"
