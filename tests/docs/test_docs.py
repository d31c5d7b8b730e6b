"""The documentation says what is true: every command is in it, its links lead somewhere, its examples run."""

import re
import shlex
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from modrob_cli.cli.app import app

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
COMMANDS = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", COMMANDS)
def test_command_is_in_the_readme_and_its_help_has_an_example(command: str) -> None:
    assert f"modrob {command}" in README
    result = CliRunner().invoke(app, [command, "--help"])
    assert result.exit_code == 0
    assert f"Example: modrob {command}" in " ".join(result.output.split())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_readme_walk_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The two documents of the README and the commands around them, in a fresh workspace."""
    module, assembly = re.findall(r"```yaml\n(.*?)```", README, flags=re.DOTALL)
    monkeypatch.chdir(tmp_path)
    for line in re.findall(r"^modrob [^\n]*", README, flags=re.MULTILINE):
        arguments = shlex.split(line, comments=True)[1:]
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 0, f"{line}: {result.output}"
        if arguments[0] == "init":
            monkeypatch.chdir(tmp_path / arguments[1])
            Path("modules/mine").mkdir()
            Path("modules/mine/TUBE.yaml").write_text(module, encoding="utf-8")
            Path("assemblies/my-arm.yaml").write_text(assembly, encoding="utf-8")
    for name in re.findall(r"`(my-arm\.[a-z.]+)`", README):
        assert (Path("out") / name).is_file(), name
