"""Every kind of bad input, through ``check`` and ``assemble``: place, words, exit code, nothing left behind."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import Result

from modrob_cli.errors import Fault
from tests.conftest import ASSEMBLY, MODULES, ROBOT

Modrob = Callable[..., Result]


def use(modules: str) -> str:
    """The good assembly with other modules."""
    return re.sub(r"modules: .*", f"modules: [{modules}]", ASSEMBLY)


@dataclass(frozen=True)
class Bad:
    """A file that cannot be used: its name, content, and what a message about it holds."""

    name: str
    text: str | bytes
    words: str
    path: str = ""
    line: int | None = None


J, L = MODULES["J"], MODULES["L"]
BOMB = "a0: &a0 [x, x]\n" + "".join(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]\n" for k in range(30))
CHAIN = "a0: &a0 [x]\n" + "".join(f"a{k + 1}: &a{k + 1} [*a{k}]\n" for k in range(800))

ROBOTS = [
    Bad("empty", "", "found an empty file"),
    Bad("only-comment", "# nothing\n", "found an empty file"),
    Bad("not-yaml", "name: [1, 2\nx: }", "not valid YAML", line=2),
    Bad("tabs", "modrob: robot/1\njoints:\n\t- name: j1\n", "found a tab in the indentation", line=3),
    Bad("repeated-key", ROBOT + "name: again\n", "found the key 'name' again (first on line 2)", "$.name", 9),
    Bad("unknown-key", ROBOT.replace("mass: 3", "mas: 3"), "did you mean mass?", "$.bodies[0].mas", 7),
    Bad("no-kind", "name: x\n", "the key modrob is missing", "$", 1),
    Bad("wrong-kind", "modrob: motor/1\n", "found 'motor/1', expected", "$.modrob", 1),
    Bad("wrong-type", ROBOT.replace("a: 0.5", "a: long"), "found 'long', expected", "$.joints[0].dh.a", 4),
    Bad("text-for-number", ROBOT.replace("a: 0.5", "a: '0.5'"), "found '0.5', expected", "$.joints[0].dh.a", 4),
    Bad("boolean-for-number", ROBOT.replace("mass: 3", "mass: true"), "found True", "$.bodies[0].mass", 7),
    Bad("list-for-mapping", ROBOT.replace("{a: 0.5}", "[0.5]"), "found a list of 1", "$.joints[0].dh", 4),
    Bad("nan", ROBOT.replace("a: 0.5", "a: .nan"), "found nan, expected a finite number", "$.joints[0].dh.a", 4),
    Bad("inf", ROBOT.replace("a: 0.5", "a: -.inf"), "found -inf, expected a finite number", "$.joints[0].dh.a", 4),
    Bad("too-large", ROBOT.replace("a: 0.5", "a: 1e999"), "found inf, expected a finite number", "$.joints[0].dh.a", 4),
    Bad("huge-integer", ROBOT.replace("a: 0.5", f"a: {'9' * 5000}"), "found inf", "$.joints[0].dh.a", 4),
    Bad("huge-angle", ROBOT.replace("a: 0.5", f"alpha: {'1' * 200_000} deg"), "an angle", "$.joints[0].dh.alpha", 4),
    Bad("negative-mass", ROBOT.replace("mass: 3", "mass: -3"), "found -3", "$.bodies[0].mass", 7),
    Bad("min-max", ROBOT.replace("mass: 3", "mass: {nominal: 3, min: 4, max: 2}"), "min <= max", "$.bodies[0].mass", 7),
    Bad("outside", ROBOT.replace("mass: 3", "mass: {nominal: 3, min: 4, max: 5}"), "inside", "$.bodies[0].mass", 7),
    Bad("lower-upper", ROBOT.replace("{a: 0.5}", "{a: 0.5}, limits: {torque: [2, 1]}"), "lower <= upper",
        "$.joints[0].limits.torque", 4),
    Bad("huge-percentage", ROBOT.replace("mass: 3", f"mass: {{nominal: 3, tol: {'9' * 400}%}}"), "a percentage",
        "$.bodies[0].mass.tol", 7),
    Bad("mixed-vector", ROBOT.replace("com: [-0.25, 0, 0]", "com: {nominal: [1, 2, 3], min: {}}"), "three numbers",
        "$.bodies[0].com", 7),
    Bad("bad-body-link", ROBOT.replace("link: 2", "link: 7"), "found link 7"),
    Bad("bomb", BOMB, "once aliases are expanded"),
    Bad("alias-chain", CHAIN, "nesting deeper than 40", line=40),
    Bad("recursive-alias", "a: &a [*a]\n", "of an anchor that is not complete", line=1),
    Bad("deep", "[" * 100_000, "nesting deeper than 40", line=1),
    Bad("deep-block", "\n".join("  " * k + "a:" for k in range(1500)), "nesting deeper than 40", line=41),
    Bad("empty-lists", "x: [" + "[]," * 110_000 + "]", "more than 100000 values", line=1),
    Bad("garbage", b"modrob: robot/1\n" + bytes(range(256)) * 40_960, "found 10.0 MiB, expected at most 4 MiB"),
    Bad("not-utf-8", b"modrob: robot/1\nname: caf\xe9\n", "found the byte 0xe9, expected UTF-8", line=2),
    Bad("utf-16", "modrob: robot/1\n".encode("utf-16"), "expected UTF-8", line=1),
    Bad("nul-byte", b"modrob: robot/1\nname: a\0b\n", "found character U+0000", line=2),
    Bad("escape-byte", b"modrob: robot/1\nname: \x1b[31mred\n", "found character U+001B", line=2),
    Bad("escaped-escape", ROBOT + 'source: "\\e[31mred"\n', "found the character U+001B in text", "$.source", 9),
    Bad("escaped-nul", ROBOT + 'source: "a\\0b"\n', "found the character U+0000 in text", "$.source", 9),
    Bad("escape-in-key", ROBOT + '"\\e]0;owned\\a": 1\n', "found the character U+001B in text", line=9),
    Bad("direction", ROBOT + "source: \u202eevil\n", "found the character U+202E in text", "$.source", 9),
    Bad("surrogate", ROBOT + 'source: "\\uD800"\n', "not valid YAML", line=9),
    Bad("two-documents", ROBOT + "---\n" + ROBOT, "found a second document", line=9),
    Bad("tag", ROBOT + "source: !!python/object/apply:os.system [true]\n", "found the tag", line=9),
    Bad("own-tag", ROBOT + "source: !env HOME\n", "found the tag '!env'", line=9),
    Bad("list-key", ROBOT + "? [a, b]\n: 1\n", "found a list or mapping as a key", line=9),
    Bad("name-with-path", ROBOT.replace("name: planar", "name: ../../etc/passwd"), "a name of letters", "$.name", 2),
    Bad("name-with-markup", ROBOT.replace("planar", "<b>planar</b>"), "a name of letters", "$.name", 2),
    Bad("name-with-line", ROBOT.replace("planar", '"planar\\n"'), "a name of letters", "$.name", 2),
]  # fmt: skip

ARMS = [
    Bad("unknown-module", use("B, J, X, E"), "module 'X', expected one of: B, E, J, L", "$.modules[2]", 4),
    Bad("unknown-connector", use("J, {module: L, output: top}"), "'top', expected one of: out, side",
        "$.modules[1].output", 4),
    Bad("which-connector", use("J, L"), "has several outputs", "$.modules[1]", 4),
    Bad("two-bases", use("B, B, J"), "found the base B as module 2", "$.modules[1]", 4),
    Bad("base-in-the-middle", use("J, B, J"), "found the base B as module 2", "$.modules[1]", 4),
    Bad("after-the-end", use("J, E, J"), "found J after the end effector E", "$.modules[2]", 4),
    Bad("no-joint", use("B, {module: L, output: out}, E"), "found no joint module", "$.modules", 4),
    Bad("own-catalogue", ASSEMBLY.replace("parts", "own-catalogue.yaml"), "a cycle of file references"),
    Bad("assembly-as-catalogue", ASSEMBLY.replace("parts", "arm.yaml"), "expected module/1", "$.modrob"),
    Bad("no-catalogue", ASSEMBLY.replace("parts", "none"), "file not found"),
    Bad("long-catalogue", ASSEMBLY.replace("parts", "n" * 300), "File name too long"),
    Bad("looping-catalogue", ASSEMBLY.replace("parts", "loop"), "file not found"),
    Bad("module-with-path", use("J, ../../E"), "found '../../E', expected a name", "$.modules[1]", 4),
    Bad("joint-names", ASSEMBLY + "joint_names: [a]\n", "found 1 names, expected 2", "$.joint_names", 6),
    Bad("limits-of-none", ASSEMBLY + "limits: {J.9: {torque: 1}}\n", "the unknown joint 'J.9'", "$.limits", 6),
    Bad("disturbance", ASSEMBLY + "disturbance: [1, 2, 3]\n", "found 3 entries", "$.disturbance", 6),
]  # fmt: skip


def expect_refusal(result: Result, out: Path, name: str, words: str, path: str = "", line: int | None = None) -> None:
    """Exit code 3, a message in one line with place and words, no traceback, no output folder."""
    assert result.exit_code == 3, (result.exit_code, result.output, result.exception)
    assert isinstance(result.exception, SystemExit)
    assert "Traceback" not in result.output
    assert result.stdout == ""
    assert not out.exists()
    assert all(c.isprintable() or c == "\n" for c in result.stderr)
    errors = [text for text in result.stderr.splitlines() if text.startswith("error: ")]
    place = f"{name}:{line}:" if line is not None else name
    assert any(place in text and words in text and path in text for text in errors), result.stderr


@pytest.mark.parametrize("command", ["check", "assemble"])
@pytest.mark.parametrize("bad", [*ROBOTS, *ARMS], ids=lambda bad: bad.name)
def test_bad_documents(modrob: Modrob, workspace: Path, bad: Bad, command: str) -> None:
    (workspace / "loop").symlink_to("loop")
    path, out = workspace / f"{bad.name}.yaml", workspace / "out" / "deep"
    path.write_bytes(bad.text if isinstance(bad.text, bytes) else bad.text.encode())
    result = modrob(command, path, *(["-o", out] if command == "assemble" else []))
    place = "own-catalogue.yaml" if bad.name == "own-catalogue" else f"{bad.name}.yaml"
    has_own_place = bad.line is not None or not bad.name.endswith("catalogue")
    expect_refusal(
        result, out.parent, place if has_own_place else ".yaml" * (bad.path != ""), bad.words, bad.path, bad.line
    )


@pytest.mark.parametrize("command", ["check", "assemble"])
@pytest.mark.parametrize("name", ["missing.yaml", "n" * 300, "a\x1b[31mb.yaml", "loop", "void/x.yaml", "arm.yaml/x"])
def test_missing_files(modrob: Modrob, workspace: Path, name: str, command: str) -> None:
    (workspace / "loop").symlink_to("loop")
    out = workspace / "out"
    result = modrob(command, workspace / name, *(["-o", out] if command == "assemble" else []))
    expect_refusal(result, out, "", "cannot be read" if len(name) > 255 else "file not found")


def test_messages_are_printable() -> None:
    fault = Fault("a\x1b[31m\n\udcff\u202e.yaml", "found it", "$.caf\u00e9", 1, 2)
    assert str(fault) == "a\\x1b[31m\\n\\udcff\\u202e.yaml:1:2: $.caf\u00e9: found it"


def test_folder_for_file(modrob: Modrob, workspace: Path) -> None:
    out = workspace / "out"
    expect_refusal(modrob("assemble", workspace / "parts", "-o", out), out, "parts", "found a folder, expected a file")


def test_module_for_robot(modrob: Modrob, workspace: Path) -> None:
    out = workspace / "out"
    result = modrob("assemble", workspace / "parts" / "L.yaml", "-o", out)
    expect_refusal(result, out, "L.yaml", "found 'module/1', expected a robot", "$.modrob", 1)


@pytest.mark.parametrize("command", ["check", "assemble"])
def test_special_files_do_not_hang(modrob: Modrob, workspace: Path, command: str) -> None:
    os.mkfifo(workspace / "pipe.yaml")
    (workspace / "zero.yaml").symlink_to("/dev/zero")
    out = workspace / "out"
    for name in ("pipe.yaml", "zero.yaml"):
        result = modrob(command, workspace / name, *(["-o", out] if command == "assemble" else []))
        expect_refusal(result, out, name, "is not a regular file")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read every file")
def test_unreadable_file(modrob: Modrob, workspace: Path) -> None:
    (workspace / "arm.yaml").chmod(0)
    out = workspace / "out"
    expect_refusal(modrob("assemble", workspace / "arm.yaml", "-o", out), out, "arm.yaml", "cannot be read: Permission")


def test_unreadable_file_without_permissions(modrob: Modrob, workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    out = workspace / "out"
    expect_refusal(modrob("assemble", workspace / "arm.yaml", "-o", out), out, "arm.yaml", "cannot be read: Permission")


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("J", J.replace("type: revolute", "type: ball"), "found 'ball', expected 'revolute' or 'prismatic'"),
        ("J", J.replace("kind: joint", "kind: link"), "kind is link"),
        ("L", L.replace("out: {a: 0.3}", "out: {a: 0.3, pose: {}}"), "either pose or"),
        ("L", L.replace("name: L", "name: J"), "the module name J is taken"),
        ("E", "modrob: module/1\nname: E\nkind: end-effector\n", "connections with at least one output"),
    ],
)
def test_a_bad_module_stops_its_assembly(modrob: Modrob, workspace: Path, name: str, text: str, words: str) -> None:
    (workspace / "parts" / f"{name}.yaml").write_text(text)
    out = workspace / "out"
    expect_refusal(modrob("assemble", workspace / "arm.yaml", "-o", out), out, f"{name}.yaml", words)


def test_all_faults_at_once_in_order(modrob: Modrob, workspace: Path) -> None:
    path = workspace / "bad.yaml"
    path.write_text(
        "modrob: robot/1\nname: ../x\njoints:\n- {name: j1, type: ball, dh: {a: .nan}}\n- {name: j2}\n"
        "bodies:\n- {link: 1, mass: -1, com: [0, 0]}\ncolor: red\n"
    )
    for command in (("check",), ("assemble", "-o", workspace / "out")):
        result = modrob(*command, path)
        found = re.findall(r"error: \S+bad\.yaml:(\d+):\d+: (\S+):", result.stderr)
        assert found == [
            ("2", "$.name"),
            ("4", "$.joints[0].type"),
            ("4", "$.joints[0].dh.a"),
            ("5", "$.joints[1].type"),
            ("7", "$.bodies[0].mass"),
            ("7", "$.bodies[0].com"),
            ("8", "$.color"),
        ]
        assert result.exit_code == 3


def test_faults_of_all_assemblies_and_nothing_written(modrob: Modrob, workspace: Path) -> None:
    (workspace / "one.yaml").write_text(use("J, X").replace("name: arm", "name: one"))
    (workspace / "two.yaml").write_text("[")
    out = workspace / "out"
    result = modrob("assemble", workspace / "arm.yaml", workspace / "one.yaml", workspace / "two.yaml", "-o", out)
    expect_refusal(result, out, "one.yaml", "unknown module 'X'", "$.modules[1]", 4)
    expect_refusal(result, out, "two.yaml", "not valid YAML", line=2)


def test_a_long_list_of_faults_is_cut(modrob: Modrob, workspace: Path) -> None:
    path = workspace / "many.yaml"
    path.write_text(ROBOT + "".join(f"k{k}: 1\n" for k in range(20_000)))
    result = modrob("check", path)
    assert result.stderr.count("unknown key") == 100
    assert "found 19900 more faults" in result.stderr


@pytest.mark.parametrize("size", ["1e150", "1e308", "5e-324"])
def test_absurd_sizes_give_an_answer_or_an_error(modrob: Modrob, workspace: Path, size: str) -> None:
    path = workspace / "absurd.yaml"
    path.write_text(ROBOT.replace("0.5", size).replace("mass: 3", f"mass: {size}").replace("-0.25", f"-{size}"))
    assert modrob("check", path).exit_code == 0
    assert modrob("check", path, "--strict").exit_code in ((0, 3) if size.startswith("5") else (3,))


@pytest.mark.parametrize("name", ["repeated-key", "escape-byte", "bomb", "two-bases"])
def test_the_installed_command(workspace: Path, name: str) -> None:
    bad = next(item for item in [*ROBOTS, *ARMS] if item.name == name)
    path = workspace / "bad.yaml"
    path.write_bytes(bad.text if isinstance(bad.text, bytes) else bad.text.encode())
    script = Path(sys.executable).with_name("modrob")
    for arguments in (["check"], ["assemble", "-o", str(workspace / "out")]):
        done = subprocess.run([script, *arguments, path], capture_output=True, text=True, timeout=60, check=False)
        assert (done.returncode, done.stdout) == (3, "")
        assert bad.words in done.stderr
        assert "Traceback" not in done.stderr
        assert not (workspace / "out").exists()
