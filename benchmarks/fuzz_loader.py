"""Throw mutated documents at ``modrob check`` and see that nothing but an answer comes out.

``python -m benchmarks.fuzz_loader --count 200000 [--seed 0]``: each input is a valid document with a few mutations of
its text (bytes flipped, parts deleted, repeated or moved, hostile snippets put in) or of its data (random values at
random places). It is written to a file and checked, plausibility and synthesis included. The only outcome allowed is
a result that lists faults and warnings; any exception is a finding, printed with the input. Ends with 1 if there
were findings.
"""

import argparse
import random
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import yaml

from modrob_cli.workflows.check import check

MODULE = """\
modrob: module/1
name: J
kind: joint
units:
- proximal: {a: 0.1, alpha: -pi/2, p: 0.02, n: 0, delta: 90 deg, body: {mass: 1.2, com: [0, 0.01, 0]}}
  joint:
    type: revolute
    delta: 0.5 rad
    friction: {viscous: {nominal: 3.9, tol: 5%}, coulomb: {nominal: 2, min: 1, max: 3}, velocity_band: 0.01}
    rotor_inertia: 5.23e-5
    gear_ratio: 160
    torque_constant: 0.0429
    limits: {position: [-170 deg, 170 deg], velocity: 1.2, torque: [-75, 75], current: 11}
  distal:
    pose: {xyz: [0, 0, 0.1], rpy: [0, pi/2, 0]}
    body:
      mass: {nominal: 3.9, tol: 0.2}
      com: {nominal: [0, 0.018, -0.082], tol: 0.001}
      inertia: {nominal: {xx: 0.0428, yy: 0.0378, zz: 0.011}, tol: 5%}
      inertia_about: frame
"""
LINK = """\
modrob: module/1
name: L
kind: link
source: a table
connections: {out: {a: 0.35, alpha: pi, delta_in: pi/2}, side: {pose: {xyz: [0.1, 0, 0]}}}
body: {mass: 1.62, com: [0, -0.175, 0.0132], inertia: [[0.074, 0, 0], [0, 0.017, 0.003], [0, 0.003, 0.074]]}
"""
ASSEMBLY = """\
modrob: assembly/1
name: arm
catalogue: [J.yaml, L.yaml]
base_pose: {xyz: [0, 0, 0.5], rpy: [0, 0, 90 deg]}
gravity: [0, 0, -9.81]
modules: [J, {module: L, output: out}, J, {module: L, output: side}]
joint_names: [shoulder, elbow]
payload: {mass: {nominal: 1, min: 0, max: 2}, com: [0, 0, 0.05], inertia: {xx: 0.001, yy: 0.001, zz: 0.001}}
disturbance: [0.5, [-1, 2]]
limits: {elbow: {torque: 20}}
"""
ROBOT = """\
modrob: robot/1
name: two-link
joints:
- {name: j1, type: revolute, dh: {a: 0.5, alpha: pi, d: 0.1, theta: -pi/2}, friction: {viscous: 1}, limits: {torque: 5}}
- {name: j2, type: prismatic, dh: {a: 0.4}, gear_ratio: 100, rotor_inertia: 1e-5, stiffness: 1000}
bodies:
- {name: b1, link: 1, mass: 3, com: [-0.2, 0, 0], inertia: {xx: 0.01, yy: 0.02, zz: 0.02, xy: {nominal: 0, tol: 0.001}}}
- {link: 2, mass: {nominal: 2, tol: 10%}, pose: {xyz: [0, 0, 0.1]}}
payload: {mass: 1}
disturbance: 0.5
"""
SEEDS = (MODULE, LINK, ASSEMBLY, ROBOT)
SNIPPETS = (
    *("{", "}", "[", "]", ":", ": ", ",", "-", "- ", "?", "? ", "!", "!!int ", "!x ", "&a ", "*a", "|", ">", "'", '"'),
    *("#", "%", "@", "`", "---\n", "...\n", "\t", "\r", "\n", "\x00", "\x1b[31m", "\x85", "\u2028", "\ufeff", "<<: "),
    *('"\\0"', '"\\e"', '"\\uD800"', '"\\x"', "\U0001f600", "\u202e", "é", ".nan", ".inf", "-.inf", "1e999", "-1e308"),
    *("5e-324", "0x1F", "0o7", "1_000", "9" * 30, "9" * 5000, "1e", "e1", "+", "~", "null", "true", "no", "2024-01-01"),
    *("pi/0", "--pi", "1e400 deg", "5%", "-5%", "1e5%", "9" * 30 + "%", "[]", "{}", "[[[[", "{{{{", "&a [*a]", "''"),
    *("nominal: ", "min: ", "max: ", "tol: ", "module/1", "assembly/1", "robot/1", "../..", "/dev/zero", ".", "J.yaml"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 10**17, -(10**25), 0.0, -0.0, 1e-320, 1e308, -1e308, float("inf"), float("nan")),
    *("", " ", "x", "pi/2", "-90 deg", "5%", "out", "J", "J.1", "a" * 300, "\x1b[0m", "é", "../../etc", "1", "null"),
    *([], {}, [0], [1, 2, 3], [[]], [{}], [0, 0, 0], [1, -1], [[1, 2, 3]] * 3, [None] * 3, ["pi"] * 3, list(range(40))),
    *({"nominal": 1}, {"nominal": [1, 2, 3], "tol": 1}, {"nominal": 1, "min": 2, "max": 0}, {"nominal": {}, "tol": []}),
    *({"nominal": {"xx": 1}, "tol": "5%"}, {"nominal": [1, 2, 3], "min": {"0": 1}}, {"pose": {}}, {"module": "J"}),
    *({"nominal": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "tol": {"xx": {}}}, {"x": {"x": {"x": {}}}}, {"": ""}),
)


def mutate_text(text: str, rng: random.Random) -> bytes:
    """Apply one to six mutations to the text of a document."""
    raw = bytearray(text.encode())
    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        at, to = rng.randrange(len(raw) + 1), rng.randrange(len(raw) + 1)
        at, to = min(at, to), min(max(at, to), min(at, to) + rng.choice((1, 4, 30, 300)))
        kind = rng.randrange(6)
        if kind == 0 and at < len(raw):
            raw[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del raw[at:to]
        elif kind == 2:
            raw[at:at] = raw[at:to] * rng.choice((1, 2, 50))
        elif kind == 3:
            part = raw[at:to]
            del raw[at:to]
            place = rng.randrange(len(raw) + 1)
            raw[place:place] = part
        elif kind == 4:
            raw[at:at] = rng.choice(SNIPPETS).encode("utf-8", "surrogatepass")
        else:
            raw = _swap_words(raw, rng)
    return bytes(raw)


def _swap_words(raw: bytearray, rng: random.Random) -> bytearray:
    """Put a word or snippet in the place of another word, everywhere or once."""
    words = bytes(raw).split()
    if not words:
        return raw
    old = rng.choice(words)
    new = rng.choice(words) if rng.random() < 0.5 else rng.choice(SNIPPETS).encode("utf-8", "surrogatepass")
    return raw.replace(old, new, rng.choice((1, -1)))


def mutate_data(data: Any, rng: random.Random) -> Any:
    """Replace, add or remove values at one to three random places of plain data (changed in place)."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        node, key = _random_place(data, rng)
        if node is None:
            return rng.choice(VALUES)
        action = rng.randrange(9)
        if action == 0:
            del node[key]
        elif action == 1 and isinstance(node, dict):
            node[rng.choice(("", "x", "tol", "min", "nominal", "pose", "body", "name", "é\x07", "a" * 99))] = node[key]
        elif action == 2 and isinstance(node, list):
            node.extend([node[key]] * rng.choice((1, 2, 60)))
        elif action < 7 and isinstance(node[key], int | float):
            node[key] *= rng.choice((-1, 0, 0.5, 2, 1e-300, 1e300, 1e6, -1e-6))
        else:
            node[key] = rng.choice(VALUES)
    return data


def _random_place(data: Any, rng: random.Random) -> tuple[Any, Any]:
    """Choose a container below the root and a key or index in it; (None, None) if there is none."""
    places: list[tuple[Any, Any]] = []
    waiting = [data]
    while waiting and len(places) < 5000:
        node = waiting.pop()
        keys = list(node) if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        places.extend((node, key) for key in keys)
        waiting.extend(node[key] for key in keys)
    return rng.choice(places) if places else (None, None)


def mutated(seed: str, rng: random.Random) -> bytes:
    """Make one input from a valid document."""
    if rng.random() < 0.5:
        return mutate_text(seed, rng)
    data = mutate_data(yaml.load(seed, yaml.CSafeLoader), rng)
    text: str = yaml.dump(data, Dumper=yaml.CSafeDumper, allow_unicode=True)
    return text.encode("utf-8", "surrogatepass") if rng.random() < 0.8 else mutate_text(text, rng)


def run(count: int, seed: int, folder: Path) -> Counter[str]:
    """Check ``count`` inputs; returns how many ended how, findings under the exception's text."""
    rng = random.Random(seed)
    (folder / "J.yaml").write_text(MODULE)
    (folder / "L.yaml").write_text(LINK)
    path = folder / "fuzz.yaml"
    outcomes: Counter[str] = Counter()
    slowest = 0.0
    for k in range(count):
        raw = mutated(SEEDS[k % len(SEEDS)], rng)
        path.write_bytes(raw)
        start = time.perf_counter()
        try:
            result = check([path])
            outcome = "faults" if result.faults else "warnings" if result.warnings else "clean"
        except Exception as error:
            outcome = f"FINDING {type(error).__name__}: {error}"[:200]
            if outcome not in outcomes:
                traceback.print_exc()
                print(f"input {k}: {raw[:3000]!r}")
        slowest = max(slowest, time.perf_counter() - start)
        outcomes[outcome] += 1
    print(f"slowest input: {slowest:.3f} s")
    return outcomes


def main() -> int:
    """Run the fuzzer from the command line."""
    parser = argparse.ArgumentParser(description="fuzz modrob's document loader")
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("error")
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        outcomes = run(options.count, options.seed, Path(folder))
    print(f"{options.count} inputs in {time.perf_counter() - start:.0f} s")
    for outcome, number in outcomes.most_common():
        print(f"{number:8d}  {outcome}")
    return int(any(outcome.startswith("FINDING") for outcome in outcomes))


if __name__ == "__main__":
    sys.exit(main())
