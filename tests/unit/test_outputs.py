"""Outputs are written whole or not at all."""

import hashlib
import os
from pathlib import Path

import pytest

from modrob_cli import __version__
from modrob_cli.errors import OutputExistsError, UsageError
from modrob_cli.io.outputs import OutputFolder, provenance


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


def test_files_appear_together_at_the_end(tmp_path: Path) -> None:
    with OutputFolder(tmp_path / "a" / "b") as out:
        path = out.write("x.csv", "t,q\n")
        out.write("y.bin", b"\x00\x01")
        assert not path.exists()
    assert path == tmp_path / "a" / "b" / "x.csv"
    assert path.read_text() == "t,q\n"
    assert names(tmp_path / "a") == ["b", "x.csv", "y.bin"]


def test_an_error_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), OutputFolder(tmp_path / "a" / "b") as out:  # noqa: PT012
        out.write("x.csv", "t,q\n")
        out.stage("z.png")
        raise ZeroDivisionError
    assert names(tmp_path) == []


def test_an_interruption_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), OutputFolder(tmp_path / "a") as out:  # noqa: PT012
        out.write("x.csv", "t,q\n")
        raise KeyboardInterrupt
    assert names(tmp_path) == []


def test_an_error_keeps_what_was_there(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("old")
    (tmp_path / "other").mkdir()
    with pytest.raises(ZeroDivisionError), OutputFolder(tmp_path, overwrite=True) as out:  # noqa: PT012
        out.write("x.csv", "new")
        raise ZeroDivisionError
    assert (tmp_path / "x.csv").read_text() == "old"
    assert names(tmp_path) == ["other", "x.csv"]


def test_existing_files_are_named_and_kept(tmp_path: Path) -> None:
    for name in ("x.csv", "y.csv"):
        (tmp_path / name).write_text("old")
    with pytest.raises(OutputExistsError, match=r"x\.csv.*y\.csv.*--overwrite"), OutputFolder(tmp_path) as out:
        out.claim(["x.csv", "new.csv", "y.csv"])
    with pytest.raises(OutputExistsError), OutputFolder(tmp_path) as out:  # noqa: PT012
        out.write("new.csv", "new")
        out.write("x.csv", "new")
    assert names(tmp_path) == ["x.csv", "y.csv"]
    assert OutputExistsError.exit_code == 6


def test_overwriting_replaces(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("old")
    with OutputFolder(tmp_path, overwrite=True) as out:
        out.write("x.csv", "new")
    assert (tmp_path / "x.csv").read_text() == "new"
    assert names(tmp_path) == ["x.csv"]


def test_one_name_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="two outputs of one name"), OutputFolder(tmp_path) as out:  # noqa: PT012
        out.write("x.csv", "1")
        out.write("x.csv", "2")
    assert names(tmp_path) == []


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_folder_in_the_place_of_a_file(tmp_path: Path, overwrite: bool) -> None:
    (tmp_path / "x.csv").mkdir()
    with pytest.raises(UsageError, match="found a folder"), OutputFolder(tmp_path, overwrite) as out:  # noqa: PT012
        out.write("a.csv", "1")
        out.write("x.csv", "1")
    assert names(tmp_path) == ["x.csv"]


@pytest.mark.parametrize("folder", ["file", "file/below", "n" * 300, "loop"])
def test_a_folder_that_cannot_be_made(tmp_path: Path, folder: str) -> None:
    (tmp_path / "file").write_text("x")
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(UsageError, match="cannot make the output folder"), OutputFolder(tmp_path / folder):
        pass
    assert names(tmp_path) == ["file", "loop"]


def test_a_folder_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.mkstemp", refuse)
    with pytest.raises(UsageError, match="cannot write into .*Permission"), OutputFolder(tmp_path / "a") as out:
        out.write("x.csv", "1")
    assert names(tmp_path) == []


def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", refuse)
    with pytest.raises(UsageError, match="cannot write into .*No space left"), OutputFolder(tmp_path / "a") as out:
        out.write("x.csv", "1")
    assert names(tmp_path) == []


def test_a_full_disk_while_a_library_writes(tmp_path: Path) -> None:
    def write() -> None:
        with OutputFolder(tmp_path / "a") as out:
            out.stage("x.png").write_bytes(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(UsageError, match="cannot write into .*No space left"):
        write()
    assert names(tmp_path) == []


def test_a_rename_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(UsageError, match="cannot write into .*Input/output"), OutputFolder(tmp_path / "a") as out:
        out.write("x.csv", "1")
    assert names(tmp_path) == []


def test_files_have_the_usual_permissions(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        with OutputFolder(tmp_path) as out:
            path = out.write("x.csv", "1")
    finally:
        os.umask(before)
    assert path.stat().st_mode & 0o777 == 0o640


def test_provenance_names_version_and_hashes(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_bytes(b"modrob: robot/1\n" * 200_000)  # more than one block
    found = provenance([path, path])
    assert found["modrob"] == __version__
    assert found["inputs"] == {"arm.yaml": "sha256:" + hashlib.sha256(path.read_bytes()).hexdigest()}


def test_files_in_a_folder_of_their_own_come_and_go_with_the_others(tmp_path: Path) -> None:
    with OutputFolder(tmp_path / "out") as folder:
        folder.write("parts/one.txt", "1")
        folder.write("parts/two.txt", "2")
    assert (tmp_path / "out" / "parts" / "two.txt").read_text() == "2"

    def write_and_stop() -> None:
        with OutputFolder(tmp_path / "new") as folder:
            folder.write("parts/one.txt", "1")
            raise ValueError("stop")

    with pytest.raises(ValueError, match="stop"):
        write_and_stop()
    assert not (tmp_path / "new").exists()
