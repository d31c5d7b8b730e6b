"""Time the commands as whole processes: ``python -m benchmarks [--many 500]``.

Machines differ and are shared: compare the last column, the ratio to ``python -c 'import numpy'`` in the same run.
The other benchmarks run by their own names, such as ``python -m benchmarks.simulate_speed``; see docs/benchmarks.md.
"""

import argparse
import tempfile
from pathlib import Path

from benchmarks.timing import MODROB, REFERENCE, time_process

ROOT = Path(__file__).parents[1]


def write_assemblies(folder: Path, count: int) -> list[str]:
    """Copies of the shipped 6-axis arm under other names, in a folder of their own."""
    text = (ROOT / "assemblies" / "lwa4p-6.yaml").read_text(encoding="utf-8")
    catalogue = ROOT / "modules" / "schunk-lwa4p"
    paths = []
    for k in range(count):
        path = folder / f"arm-{k}.yaml"
        changed = text.replace("name: lwa4p-6", f"name: arm-{k}").replace("../modules/schunk-lwa4p", str(catalogue))
        path.write_text(changed, encoding="utf-8")
        paths.append(str(path))
    return paths


def main() -> None:
    """Run and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--many", type=int, default=500, help="assemblies in one call")
    many = parser.parse_args().many
    assemblies = ROOT / "assemblies"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        out = str(folder / "out")
        paths = write_assemblies(folder, many)
        write = ["-o", out, "--overwrite"]
        cases = [
            ("python -c 'import numpy' (reference)", REFERENCE, 5),
            ("modrob --help", [*MODROB, "--help"], 5),
            ("modrob check modules assemblies", [*MODROB, "check", str(ROOT / "modules"), str(assemblies)], 3),
            ("modrob assemble, 6 axes", [*MODROB, "assemble", str(assemblies / "lwa4p-6.yaml"), *write], 5),
            ("modrob assemble, 6 axes, 5 %", [*MODROB, "assemble", str(assemblies / "lwa4p-6-tol5.yaml"), *write], 5),
            (f"modrob assemble, {many} arms", [*MODROB, "assemble", *paths, *write], 1),
        ]
        print(f"{'command':38} {'min':>7} {'median':>7} {'max':>7} {'MiB':>6} {'ratio':>6}")
        reference = 0.0
        for title, command, runs in cases:
            timing = time_process(command, runs)
            reference = reference or timing.median
            seconds = f"{timing.least:7.3f} {timing.median:7.3f} {timing.most:7.3f}"
            print(f"{title:38} {seconds} {timing.peak:6.0f} {timing.median / reference:6.1f}")


if __name__ == "__main__":
    main()
