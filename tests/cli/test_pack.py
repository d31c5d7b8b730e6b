import struct
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from modrob_cli.assembly.dh_synthesis import dh_table
from modrob_cli.cli.app import app
from modrob_cli.io.documents import read_document
from modrob_cli.io.shipped import shipped_folder
from modrob_cli.schema import ModuleDocument
from modrob_cli.workflows.robots import load_robot

ARM = shipped_folder("modules") / "schunk-lwa4p"
ALL = sorted(shipped_folder("modules").rglob("*.yaml"))


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize(("name", "size"), [("PB1", 296), ("PB3", 296), ("L1", 64), ("L3", 64)])
def test_published_sizes(name: str, size: int, tmp_path: Path) -> None:
    # [D] end of 2.4.1: 148 bytes for a simple joint module (a power ball is two), 64 for a link module
    out = tmp_path / "module.bin"
    result = run("pack", ARM / f"{name}.yaml", "-o", out)
    assert result.exit_code == 0, result.stderr
    assert result.stdout == ""
    assert out.stat().st_size == size
    assert "name" in result.stderr


def test_numbers_of_a_real_module_are_where_they_should_be(tmp_path: Path) -> None:
    out = tmp_path / "PB1.bin"
    run("pack", ARM / "PB1.yaml", "-o", out)
    first = struct.unpack_from("<37f", out.read_bytes())
    # from the published table: alpha, p, n of unit A; mass; viscous, Coulomb, torque constant, rotor inertia, gear
    np.testing.assert_array_equal(first[6:9], np.array([-np.pi / 2, -0.1013, 0.1013], dtype="f4"))
    assert first[22] == np.float32(3.9)
    np.testing.assert_array_equal(first[32:], np.array([15.68, 7.14, 0.0429, 5.23e-5, 160], dtype="f4"))


@pytest.mark.parametrize("path", ALL, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_whole_catalogue_comes_back(path: Path, tmp_path: Path) -> None:
    packed, back = tmp_path / "module.bin", tmp_path / "module.yaml"
    assert run("pack", path, "-o", packed, "--extended").exit_code == 0
    result = run("unpack", packed, "-o", back)
    assert result.exit_code == 0, result.stderr
    original, copy = (read_document(file, ModuleDocument)[0].to_model() for file in (path, back))
    assert (copy.name, copy.kind, copy.source) == (original.name, original.kind, original.source)
    for key, part in original.outputs.items():
        np.testing.assert_array_equal(copy.outputs[key].transform, part.transform)
        assert np.all(copy.outputs[key].body.mass.interval.encloses(part.body.mass.interval))
        assert np.all(copy.outputs[key].body.inertia.interval.encloses(part.body.inertia.interval))
    for unit, was in zip(copy.units, original.units, strict=True):
        np.testing.assert_array_equal(unit.proximal.transform, was.proximal.transform)
        np.testing.assert_array_equal(unit.distal.transform, was.distal.transform)
        assert (unit.joint.limits, unit.joint.offset) == (was.joint.limits, was.joint.offset)
        assert np.all(unit.joint.friction.viscous.interval.encloses(was.joint.friction.viscous.interval))


def test_arm_of_unpacked_modules_has_the_same_table(tmp_path: Path) -> None:
    for name in ("PB1", "L1", "PB2", "L2", "PB3", "L3"):
        packed = tmp_path / f"{name}.bin"
        run("pack", ARM / f"{name}.yaml", "-o", packed)
        kind = ["--kind", "end-effector"] if name == "L3" else []
        assert run("unpack", packed, "-o", tmp_path / f"{name}.yaml", "--name", name, *kind).exit_code == 0
    chain = "modules: [PB1, L1, PB2, L2, PB3, L3]"
    arm = tmp_path / "arm.yaml"
    arm.write_text(f"modrob: assembly/1\nname: arm\ncatalogue: .\n{chain}\n", encoding="utf-8")
    table = dh_table(load_robot(arm).robot)
    original = dh_table(load_robot(shipped_folder("assemblies") / "lwa4p-6.yaml").robot)
    # short decimals come back as written and angles as multiples of pi/12: nothing is left of the rounding
    for key in ("a", "alpha", "d", "gamma", "p", "n"):
        np.testing.assert_allclose(getattr(table, key), getattr(original, key), atol=1e-15)


def test_poses_are_turned_into_parameters(tmp_path: Path) -> None:
    document = tmp_path / "J.yaml"
    document.write_text(
        "modrob: module/1\nname: J\nkind: joint\nunits:\n"
        "  - proximal: {pose: {xyz: [0.1, 0.2, 0.3], rpy: [0.3, -0.2, 0.5]}}\n"
        "    joint: {type: revolute, delta: 0.25}\n"
        "    distal: {pose: {xyz: [-0.3, 0.1, 0.2], rpy: [pi, 0, 1.0]}}\n",
        encoding="utf-8",
    )
    packed, back = tmp_path / "J.bin", tmp_path / "J2.yaml"
    run("pack", document, "-o", packed, "--extended")
    assert run("unpack", packed, "-o", back).exit_code == 0
    poses = []
    for file in (document, back):
        (unit,) = read_document(file, ModuleDocument)[0].to_model().units
        c, s = np.cos(unit.joint.offset + 0.7), np.sin(unit.joint.offset + 0.7)
        turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
        poses.append(unit.proximal.transform @ turn @ unit.distal.transform)
    np.testing.assert_allclose(poses[1], poses[0], atol=1e-14)


def test_what_the_plain_form_loses_is_said(tmp_path: Path) -> None:
    tol5 = shipped_folder("modules") / "schunk-lwa4p-tol5" / "PB3.yaml"
    said = run("pack", tol5, "-o", tmp_path / "a.bin").stderr
    assert "bounds are not stored" in said
    assert "limits" in said
    said = run("pack", shipped_folder("modules") / "reconfigurable-2r" / "L.yaml", "-o", tmp_path / "b.bin").stderr
    assert "outA, outB, outC, outD" in said
    assert (tmp_path / "b.bin").stat().st_size == 4 * 64
    said = run("pack", shipped_folder("modules") / "reconfigurable-2r" / "J.yaml", "-o", tmp_path / "c.bin").stderr
    assert "stiffness" in said
    said = run("unpack", tmp_path / "b.bin", "--name", "L", "-o", tmp_path / "b.yaml").stderr
    assert "taken as a link" in said
    extended = run("pack", tol5, "-o", tmp_path / "d.bin", "--extended")
    assert "warning" not in extended.stderr


def test_existing_output_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "PB1.bin"
    out.write_bytes(b"mine")
    refused = run("pack", ARM / "PB1.yaml", "-o", out)
    assert refused.exit_code == 6
    assert out.read_bytes() == b"mine"
    assert run("pack", ARM / "PB1.yaml", "-o", out, "--overwrite").exit_code == 0
    document = tmp_path / "PB1.yaml"
    document.write_text("mine", encoding="utf-8")
    assert run("unpack", out, "--name", "PB1", "-o", document).exit_code == 6
    assert document.read_text(encoding="utf-8") == "mine"
    assert run("unpack", out, "--name", "PB1", "-o", document, "--overwrite").exit_code == 0


def bad_files(folder: Path) -> list[tuple[str, list[str]]]:
    """Files that are no module, and words that the message has to have."""
    whole, extended = folder / "whole.bin", folder / "extended.bin"
    run("pack", ARM / "PB1.yaml", "-o", whole)
    run("pack", ARM / "PB1.yaml", "-o", extended, "--extended")
    good, rich = whole.read_bytes(), extended.read_bytes()
    contents = {
        "empty.bin": (b"", ["0 bytes"]),
        "short.bin": (good[:-1], ["295 bytes", "148"]),
        "nan.bin": (good[:60] + struct.pack("<f", float("nan")) + good[64:], ["nan", "byte 60", "proximal.com.z"]),
        "mass.bin": (good[:48] + struct.pack("<f", -3.9) + good[52:], ["-3.9", "mass"]),
        "text.bin": (b"modrob: module/1\n", ["17 bytes", "expected"]),
        "large.bin": (bytes(2**20 + 1), ["1048577 bytes"]),
        "cut.bin": (rich[:-7], ["truncated"]),
        "long.bin": (rich + b"\0\0", ["too long"]),
        "flip.bin": (rich[:99] + bytes([rich[99] ^ 4]) + rich[100:], ["checksum", "corrupt"]),
        "mark.bin": (b"N" + rich[1:], ["mark"]),
    }
    for name, (raw, _) in contents.items():
        (folder / name).write_bytes(raw)
    (folder / "folder.bin").mkdir()
    rest = [("folder.bin", ["folder"]), ("missing.bin", ["not found"])]
    return [(name, words) for name, (_, words) in contents.items()] + rest


def test_bad_files_are_refused_in_words_and_leave_nothing(tmp_path: Path) -> None:
    source, target = tmp_path / "in", tmp_path / "out"
    source.mkdir()
    for name, words in bad_files(source):
        naming = [] if name in ("cut.bin", "long.bin", "flip.bin") else ["--name", "PB1"]
        result = run("unpack", source / name, "-o", target / "PB1.yaml", *naming)
        assert result.exit_code == 3, (name, result.output)
        assert name in result.stderr
        assert all(word in result.stderr for word in words), (name, result.stderr)
        assert not target.exists()


@pytest.mark.parametrize(
    ("options", "word"),
    [([], "--name"), (["--name", "../evil"], "--name"), (["--name", "PB1", "--kind", "robot"], "--kind")],
)
def test_usage_of_unpack(options: list[str], word: str, tmp_path: Path) -> None:
    packed = tmp_path / "PB1.bin"
    run("pack", ARM / "PB1.yaml", "-o", packed)
    result = run("unpack", packed, "-o", tmp_path / "PB1.yaml", *options)
    assert result.exit_code == 2
    assert word in result.stderr
    assert not (tmp_path / "PB1.yaml").exists()


def test_wrong_kind_for_the_size(tmp_path: Path) -> None:
    packed = tmp_path / "PB1.bin"
    run("pack", ARM / "PB1.yaml", "-o", packed)
    result = run("unpack", packed, "-o", tmp_path / "PB1.yaml", "--name", "PB1", "--kind", "link")
    assert result.exit_code == 3
    assert "296 bytes, expected a multiple of 64" in result.stderr


def test_extended_form_takes_no_name(tmp_path: Path) -> None:
    packed = tmp_path / "PB1.bin"
    run("pack", ARM / "PB1.yaml", "-o", packed, "--extended")
    assert run("unpack", packed, "-o", tmp_path / "PB1.yaml", "--name", "PB2").exit_code == 2


def test_output_that_is_a_folder(tmp_path: Path) -> None:
    assert run("pack", ARM / "PB1.yaml", "-o", tmp_path).exit_code == 2


def test_pack_refuses_other_documents(tmp_path: Path) -> None:
    result = run("pack", shipped_folder("assemblies") / "lwa4p-6.yaml", "-o", tmp_path / "out" / "a.bin")
    assert result.exit_code == 3
    assert "module/1" in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["pack", "unpack"])
def test_help_has_an_example(command: str) -> None:
    result = run(command, "--help")
    assert result.exit_code == 0
    assert f"Example: modrob {command}" in result.output
