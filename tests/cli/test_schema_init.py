import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from modrob_cli.cli.app import app
from modrob_cli.errors import ModrobError
from modrob_cli.io import shipped
from modrob_cli.io.shipped import SHIPPED_FOLDERS, shipped_files, shipped_folder


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize("kind", ["module/1", "assembly/1", "robot/1", "robot", "trajectory/1", "task/1", "scenario/1"])
def test_schema_is_printed(kind: str) -> None:
    result = run("schema", kind)
    assert result.exit_code == 0
    schema = json.loads(result.stdout)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert schema["title"] == f"modrob {kind.split('/')[0]}/1"
    assert "$id" not in schema
    assert schema["properties"]["modrob"]["const"] == f"{kind.split('/')[0]}/1"
    assert schema["additionalProperties"] is False


def test_schema_says_what_a_quantity_may_be() -> None:
    mass = json.loads(run("schema", "module/1").stdout)["$defs"]["BodySpec"]["properties"]["mass"]
    assert {"type": "number"} in mass["anyOf"]
    assert {"$ref": "#/$defs/ScalarSpec"} in mass["anyOf"]


@pytest.mark.parametrize("kind", ["log/1", "", "module/2", "\x1b[31m"])
def test_unknown_schema_lists_the_kinds(kind: str) -> None:
    result = run("schema", kind)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "module/1, assembly/1, robot/1" in result.stderr
    assert "\x1b" not in result.stderr


def test_init_lays_out_a_workspace_that_checks(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "arm"
    result = run("init", folder)
    assert result.exit_code == 0, result.stderr
    assert result.stdout == ""
    for name in SHIPPED_FOLDERS:
        for file in shipped_files(name):
            assert (folder / name / file).read_bytes() == (shipped_folder(name) / file).read_bytes()
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert "modrob check ." in readme
    assert "modrob assemble assemblies/lwa4p-6.yaml" in readme
    assert run("check", folder).exit_code == 0


def test_init_refuses_to_overwrite(tmp_path: Path) -> None:
    mine = tmp_path / "assemblies" / "lwa4p-6.yaml"
    mine.parent.mkdir()
    mine.write_text("mine", encoding="utf-8")
    result = run("init", tmp_path)
    assert result.exit_code == 6
    assert "lwa4p-6.yaml" in result.stderr
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [mine]
    assert run("init", tmp_path, "--overwrite").exit_code == 0
    assert mine.read_text(encoding="utf-8").startswith("modrob: assembly/1")


def test_init_keeps_files_of_the_user(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    assert run("init", tmp_path).exit_code == 0
    assert (tmp_path / "notes.txt").read_text(encoding="utf-8") == "mine"


def test_init_into_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    assert run("init", tmp_path / "file").exit_code == 2


def test_shipped_data_inside_the_package_come_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = tmp_path / "site" / "modrob_cli" / "io" / "shipped.py"
    monkeypatch.setattr(shipped, "__file__", str(module))
    with pytest.raises(ModrobError, match="shipped data are missing"):
        shipped_folder("modules")
    (tmp_path / "site" / "modules").mkdir(parents=True)
    assert shipped_folder("modules") == tmp_path / "site" / "modules"
    (tmp_path / "site" / "modrob_cli" / "shipped" / "modules").mkdir(parents=True)
    assert shipped_folder("modules") == tmp_path / "site" / "modrob_cli" / "shipped" / "modules"


@pytest.mark.parametrize("command", ["schema", "init"])
def test_help_has_an_example(command: str) -> None:
    result = run(command, "--help")
    assert result.exit_code == 0
    assert f"Example: modrob {command}" in result.output
