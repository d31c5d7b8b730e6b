"""Times of ``modrob scale`` on the motion of [S] IV.A: ``python -m benchmarks.scale_speed``.

The factor from 5000 samples, a proof, and checking its certificate, in processor seconds of one process.
"""

import tempfile
import time
from pathlib import Path

import numpy as np

from modrob_cli.io.certificate import certificate_text
from modrob_cli.scaling.certify import certify
from modrob_cli.scaling.sampled import States, sampled_factors
from modrob_cli.scaling.speed_limits import speed_limits
from modrob_cli.workflows.scale_certificate import certificate_data
from modrob_cli.workflows.scale_problem import ScaleOptions, ranges_by, read_problem
from modrob_cli.workflows.scale_verify import verify

ROOT = Path(__file__).parents[1]
FILES = (ROOT / "assemblies" / "lwa4p-table34.yaml", ROOT / "trajectories" / "s-iv-a.yaml")
CURRENTS = (8.0, 8.0, 8.0, 8.0, 2.0, 2.0)
RUNS = 5


def main() -> None:
    """Run and print the smallest times."""
    limits = (("current", tuple((-x, x) for x in CURRENTS)), ("velocity", (None,)), ("acceleration", (None,)))
    problem = read_problem(*FILES, ScaleOptions(limits=limits, certify=True))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "certificate.json"
        for _ in range(RUNS):
            clock = [time.process_time()]
            states = States.of(problem.trajectory, np.linspace(0.0, problem.trajectory.duration, 5000))
            speeds = speed_limits(problem.trajectory, problem.robot)
            make = ranges_by(problem.robot, "exact")
            sampled = sampled_factors(make, states, problem.limits, speeds, (0.01, 10.0))
            clock.append(time.process_time())
            assert sampled.factor is not None
            span = (0.01, sampled.factor)
            proof = certify(problem.robot, problem.trajectory, problem.limits, span, problem.options.gap)
            clock.append(time.process_time())
            path.write_text(certificate_text(certificate_data(problem, FILES, None, sampled, proof, path.parent)))
            begun = time.process_time()
            faults = verify(path).faults
            rows.append([*np.diff(clock), time.process_time() - begun])
            assert not faults
    names = ("factor from 5000 samples", "proof", "checking the certificate")
    for name, seconds in zip(names, np.min(rows, axis=0), strict=True):
        print(f"{name:28} {seconds:6.3f} s")
    print(f"{proof.cells.count} cells; factor {sampled.factor:.6g} at the samples, {proof.factor:.6g} proven")


if __name__ == "__main__":
    main()
