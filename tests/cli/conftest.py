"""Logs that several tests of the command line share."""

from pathlib import Path

import pytest

ARM = Path(__file__).parents[2] / "assemblies" / "lwa4p-table34-friction.yaml"
MOTION = """modrob: trajectory/1
name: short
kind: waypoints
order: 5
points:
- {t: 0, q: [0, 0, 0, 0, 0, 0]}
- {t: 2, q: [0.6, 0.5, -0.5, 0.6, 0.5, -0.6]}
"""
PUSHED = """modrob: scenario/1
name: pushed
seed: 2
control: {name: feedforward-pd, friction: desired, rate: 500}
truth: {draw: uniform}
contacts:
- {name: push, link: 4, force: [0, 0, -250], start: 0.9, duration: 0.4}
sensors: {velocity: {noise: 1e-4}, effort: {noise: 0.05}, noise: uniform, effort_kind: current}
"""


@pytest.fixture(scope="session")
def hit_logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with motion.yaml, and logs clean.mcap and pushed.mcap."""
    from typer.testing import CliRunner

    from modrob_cli.cli.app import app

    folder = tmp_path_factory.mktemp("logs")
    (folder / "motion.yaml").write_text(MOTION, encoding="utf-8")
    (folder / "pushed.yaml").write_text(PUSHED, encoding="utf-8")
    clean = "\n".join(line for line in PUSHED.splitlines() if "push, link" not in line and "contacts" not in line)
    (folder / "clean.yaml").write_text(clean, encoding="utf-8")
    for name in ("clean", "pushed"):
        command = ["simulate", str(ARM), str(folder / "motion.yaml"), "--scenario", str(folder / f"{name}.yaml")]
        result = CliRunner().invoke(app, [*command, "-o", str(folder / f"{name}.mcap")])
        assert result.exit_code == 0, result.output
    return folder
