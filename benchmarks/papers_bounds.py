"""The sampled bounds of [D] 3.5.1 and 3.5.2 for the two-link arm: ``python -m benchmarks.papers_bounds``.

100 000 samples, as published, for each of five seeds; the equations are [D] (3.41)-(3.43). M11 comes in
two forms: as printed, with m1 lc1, and as physics has it, with m1 lc1^2.
"""

from dataclasses import dataclass

import numpy as np

from modrob_cli.arrays import Array

SAMPLES = 100_000
SEEDS = 5
G = 9.81
PUBLISHED = {
    "B_m": 0.029,
    "B_M": 1.158,
    "alpha_cr": 0.977,
    "eta_cr": 128.35,
    "Q_M": 10.3,
    "beta_0": 0.86,
    "beta_1": 34.27,
    "beta_2": 9.95,
    "beta_3": 210.65,
}
SMALLEST = ("B_m", "beta_0")
"""Lower bounds: the smallest over all samples; the others are the largest."""


@dataclass(frozen=True)
class Arm:
    """The arm at samples: inertia matrix (T, 2, 2), Coriolis and centrifugal torque and gravity torque (T, 2)."""

    M: Array
    coriolis: Array
    gravity: Array
    h: Array

    @classmethod
    def of(cls, q: Array, dq: Array, m2: Array, I2: Array, c2: Array, printed: bool) -> "Arm":
        """Link 2 with mass, inertia and centre of mass (T,); link 1 and its length are known."""
        m1, I1, c1, l1 = 10.0, 10.0 / 12.0, 0.5, 1.0
        cos, h = np.cos(q[:, 1]), m2 * l1 * c2 * np.sin(q[:, 1])
        M11 = I1 + I2 + m1 * (c1 if printed else c1**2) + m2 * (l1**2 + c2**2 + 2.0 * l1 * c2 * cos)
        M12, M22 = I2 + m2 * (c2**2 + l1 * c2 * cos), I2 + m2 * c2**2
        M = np.moveaxis(np.array([[M11, M12], [M12, M22]]), 2, 0)
        v = -h * dq[:, 1] * dq[:, 0] - h * (dq[:, 0] + dq[:, 1]) * dq[:, 1]
        coriolis = np.stack([v, h * dq[:, 0] ** 2], axis=1)
        outer = m2 * c2 * G * np.cos(q.sum(axis=1))
        gravity = np.stack([(m1 * c1 + m2 * l1) * G * np.cos(q[:, 0]) + outer, outer], axis=1)
        return cls(M, coriolis, gravity, h)


def sampled(seed: int, printed: bool, samples: int = SAMPLES) -> dict[str, float]:
    """The bounds from one set of samples."""
    rng = np.random.default_rng(seed)
    q, dq = rng.uniform(0.0, 2.0 * np.pi, (samples, 2)), rng.uniform(0.0, np.pi, (samples, 2))
    m2, I2 = 5.0 + rng.uniform(0.0, 5.0, samples), rng.uniform(10.0, 25.0, samples) / 12.0
    c2 = 0.5 + rng.uniform(0.0, 0.025, samples)
    d = rng.uniform(-10.0, 10.0, (samples, 2))
    true = Arm.of(q, dq, m2, I2, c2, printed)
    ones = np.ones(samples)
    nominal = Arm.of(q, dq, 5.0 * ones, 10.0 / 12.0 * ones, 0.5 * ones, printed)
    sizes = np.linalg.eigvalsh(true.M)
    off = np.eye(2) - np.linalg.solve(true.M, nominal.M)
    bias = nominal.coriolis + nominal.gravity - true.coriolis - true.gravity
    # y_1 = dq' L_1 v and y_2 = dq' L_2 v with L_1 = -h ((0, 1), (1, 1)), L_2 = h ((1, 0), (0, 0))
    spread = np.hypot(np.linalg.norm([[0.0, 1.0], [1.0, 1.0]], 2), 1.0)
    largest = {
        "B_m": 1.0 / sizes[:, 1],
        "B_M": 1.0 / sizes[:, 0],
        "alpha_cr": np.linalg.norm(off, 2, axis=(1, 2)),
        "eta_cr": np.linalg.norm(bias, axis=1),
        "Q_M": planned_acceleration(),
        "beta_0": sizes[:, 0],
        "beta_1": sizes[:, 1],
        "beta_2": np.abs(true.h) * spread,
        "beta_3": np.linalg.norm(true.gravity - d, axis=1),
    }
    return {key: float(value.min() if key in SMALLEST else value.max()) for key, value in largest.items()}


def planned_acceleration() -> Array:
    """Norm of the acceleration of the motion [D] (3.44) over one period, shape (K,)."""
    t = np.linspace(0.0, 4.0, 40_001)
    a, b = 0.5 * np.pi, np.pi
    # sin(a t) sin(b t) = (cos((b - a) t) - cos((b + a) t)) / 2
    curve = 0.5 * ((b + a) ** 2 * np.cos((b + a) * t) - (b - a) ** 2 * np.cos((b - a) * t))
    return np.abs(curve) * float(np.hypot(np.pi / 4.0, np.pi / 8.0))


def main() -> None:
    """Print the table."""
    found = {printed: [sampled(seed, printed) for seed in range(SEEDS)] for printed in (True, False)}
    print("| bound | published | M11 as printed | M11 as in physics |")
    print("|---|---|---|---|")
    for key, published in PUBLISHED.items():
        cells = []
        for runs in found.values():
            values = [run[key] for run in runs]
            cells.append(f"{min(values):.4g} .. {max(values):.4g}")
        print(f"| {key} | {published:g} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
