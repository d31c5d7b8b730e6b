"""``modrob demo`` leaves what it says."""

import re
from pathlib import Path

from typer.testing import CliRunner

from modrob_cli.cli.app import app


def test_demo_leaves_what_it_says(tmp_path: Path) -> None:
    out = tmp_path / "demo"
    result = CliRunner().invoke(app, ["demo", "-o", str(out)], catch_exceptions=False)
    assert result.exit_code == 0, result.stderr
    assert (out / "pose" / "lwa4p-6.png").is_file()
    guide = (out / "README.md").read_text(encoding="utf-8")
    for pattern in re.findall(r"^\| `([^`]+)`", guide, flags=re.MULTILINE):
        assert (out / pattern.replace("NAME", "scara")).is_file(), pattern
    assert "PB3.2" in result.stderr
    assert CliRunner().invoke(app, ["demo", "-o", str(out)]).exit_code == 6
