"""Which files are meant by folders, patterns and lists; against what is there, walked by hand."""

import io
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.log_sources import find_logs, job_names, local_copy

Tree = Callable[..., None]


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Tree:
    """Makes empty files in a fresh current folder."""
    monkeypatch.chdir(tmp_path)

    def make(*names: str) -> None:
        for name in names:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            Path(name).touch()

    return make


def faults_of(*arguments: str) -> list[Fault]:
    with pytest.raises(InputFileError) as caught:
        find_logs(arguments)
    return list(caught.value.faults)


def test_files_keep_their_order_and_spelling(tree: Tree) -> None:
    tree("b.mcap", "a.csv", "plan.yaml")
    assert find_logs(["./b.mcap", "a.csv", "plan.yaml"]) == ["./b.mcap", "a.csv", "plan.yaml"]


def test_folders_hold_mcap_files_in_natural_order(tree: Tree) -> None:
    tree("runs/run_10.mcap", "runs/run_2.mcap", "runs/Run_1.MCAP", "runs/day2/x.mcap", "runs/day10/x.mcap")
    tree("runs/table.csv", "runs/.hidden.mcap", "runs/.hidden/y.mcap", "runs/notes.txt", "runs/mcap")
    found = ["day2/x.mcap", "day10/x.mcap", "Run_1.MCAP", "run_2.mcap", "run_10.mcap"]
    assert find_logs(["runs"]) == [f"runs/{name}" for name in found]
    assert find_logs(["runs/"]) == [f"runs/{name}" for name in found]


def test_what_modrob_wrote_is_no_log_unless_it_is_asked_for(tree: Tree) -> None:
    own = ["a.collision.mcap", "a.collision.csv", "a.validate.csv", "arm.validate.logs.csv", "arm.collision.events.csv"]
    tree("a.mcap", "b.csv", *own)
    assert find_logs(["."]) == ["a.mcap"]
    assert find_logs(["*.*"]) == ["a.mcap", "b.csv"]
    assert find_logs(["*.collision.mcap"]) == ["a.collision.mcap"]
    assert find_logs(["a.collision.csv"]) == ["a.collision.csv"]


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        ("runs/*.mcap", ["runs/a2.mcap", "runs/a10.mcap"]),
        ("runs/**/*.mcap", ["runs/a2.mcap", "runs/a10.mcap", "runs/x/b.mcap", "runs/x/y/c.mcap"]),
        ("**/c.mcap", ["runs/x/y/c.mcap"]),
        ("runs/a[13]*.mcap", ["runs/a10.mcap"]),
        ("runs/a?.mcap", ["runs/a2.mcap"]),
        ("runs/x/*.csv", ["runs/x/d.csv"]),
        ("r*/x", ["runs/x/b.mcap", "runs/x/y/c.mcap"]),
        ("r*/x/b.mcap", ["runs/x/b.mcap"]),
        ("r*/../r*/x/b.mcap", ["runs/../runs/x/b.mcap"]),
        ("runs/**", ["runs/a2.mcap", "runs/a10.mcap", "runs/x/b.mcap", "runs/x/y/c.mcap"]),
        ("**/x/**/*.mcap", ["runs/x/b.mcap", "runs/x/y/c.mcap"]),
        ("runs/.*.mcap", ["runs/.secret.mcap"]),
    ],
)
def test_patterns(tree: Tree, pattern: str, found: list[str]) -> None:
    tree("runs/a10.mcap", "runs/a2.mcap", "runs/x/b.mcap", "runs/x/y/c.mcap", "runs/x/d.csv", "runs/.secret.mcap")
    assert sorted(find_logs([pattern])) == sorted(found)


def test_patterns_that_match_a_folder_inside_another(tree: Tree) -> None:
    tree("runs/x/m/x/deep.mcap", "runs/x/m/z.mcap", "runs/other.mcap")
    assert find_logs(["runs/**/x/**/*.mcap"]) == ["runs/x/m/x/deep.mcap", "runs/x/m/z.mcap"]


def test_absolute_patterns_and_the_home_folder(tree: Tree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tree("home/runs/a.mcap")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    there = str(tmp_path / "home" / "runs" / "a.mcap")
    for argument in (f"{tmp_path}/home/r*/*.mcap", "~/runs/*.mcap", "~/runs", "~/runs/a.mcap", f"file://{there}"):
        assert find_logs([argument]) == [there]


def test_a_name_that_exists_is_no_pattern(tree: Tree) -> None:
    tree("run[1].mcap", "run1.mcap", "what?.mcap", "run[1]/x.mcap", "~/y.mcap")
    assert find_logs(["run[1].mcap"]) == ["run[1].mcap"]
    assert find_logs(["what?.mcap"]) == ["what?.mcap"]
    assert find_logs(["run[1]"]) == ["run[1]/x.mcap"]
    assert find_logs(["~"]) == ["~/y.mcap"]


def test_the_same_file_counts_once(tree: Tree, tmp_path: Path) -> None:
    tree("runs/b.mcap", "runs/a.mcap")
    Path("runs/0-latest.mcap").symlink_to("b.mcap")
    arguments = ["runs/b.mcap", "runs", "./runs/*.mcap", str(tmp_path / "runs" / "a.mcap"), "runs/0-latest.mcap"]
    assert find_logs(arguments) == ["runs/b.mcap", "runs/a.mcap"]
    assert find_logs(["runs"]) == ["runs/a.mcap", "runs/b.mcap"]


def test_links_to_folders_are_followed_once_and_never_upwards(tree: Tree) -> None:
    tree("data/far/a.mcap", "here/b.mcap", "outside.mcap")
    Path("here/0-latest").symlink_to("sub")
    tree("here/sub/c.mcap")
    Path("here/linked").symlink_to("../data/far")
    Path("here/up").symlink_to("..")
    Path("here/sub/loop").symlink_to(".")
    Path("here/itself").symlink_to("itself")
    Path("data/far/back").symlink_to("../../here")
    expected = ["here/b.mcap", "here/linked/a.mcap", "here/sub/c.mcap"]
    assert find_logs(["here"]) == expected
    assert find_logs(["here/**/*.mcap"]) == expected


def test_many_links_in_circles_do_not_hang(tree: Tree) -> None:
    for k in range(12):
        tree(f"runs/d{k}/x.mcap")
        for j in range(12):
            Path(f"runs/d{k}/to{j}").symlink_to(f"../d{j}")
    assert find_logs(["runs"]) == [f"runs/d{k}/x.mcap" for k in range(12)]
    assert len(find_logs(["runs/**/*.mcap"])) == 12


def test_a_folder_that_cannot_be_entered_fails_like_a_log(tree: Tree) -> None:
    tree("runs/a.mcap", "runs/shut/b.mcap")
    Path("runs/shut").chmod(0)
    try:
        if os.access("runs/shut", os.R_OK):
            pytest.skip("this user may enter every folder")
        for argument in ("runs", "runs/**/*.mcap", "runs/*/*.mcap"):
            assert "runs/shut" in find_logs([argument])
        with (
            pytest.raises(InputFileError, match="runs/shut: cannot be read: .*below are missing"),
            local_copy("runs/shut"),
        ):
            pass
    finally:
        Path("runs/shut").chmod(0o700)


def test_a_broken_link_in_a_folder_fails_by_its_name(tree: Tree) -> None:
    tree("runs/a.mcap")
    Path("runs/gone.mcap").symlink_to("nowhere.mcap")
    assert find_logs(["runs"]) == ["runs/a.mcap", "runs/gone.mcap"]
    with pytest.raises(InputFileError, match="gone.mcap: found a link to a file that is not there"):
        local_copy("runs/gone.mcap").__enter__()


def test_a_missing_file_is_an_error_here_only_if_it_is_the_only_one(tree: Tree) -> None:
    tree("a.mcap")
    assert find_logs(["a.mcap", "b.mcap"]) == ["a.mcap", "b.mcap"]
    assert str(faults_of("b.mcap")[0]) == "b.mcap: file not found; check the path"
    assert str(faults_of("~nobody-of-this-name/b.mcap")[0]).endswith("file not found; check the path")


def test_faults_of_all_arguments_are_reported_together(tree: Tree) -> None:
    tree("a.mcap", "empty/x.csv", "empty/.y.mcap")
    faults = faults_of("a.mcap", "empty", "no*.mcap", "", "\x1b[31m*")
    assert [fault.file for fault in faults] == ["empty", "no*.mcap", "", "\x1b[31m*"]
    assert "'runs/*.csv'" in faults[0].message
    assert "found nothing that matches" in faults[1].message
    assert "\x1b" not in str(faults[3])


def test_lists_of_logs(tree: Tree, monkeypatch: pytest.MonkeyPatch) -> None:
    tree("a.mcap", "runs/b.mcap", "it's # odd.mcap", "n\xe4me.mcap")
    raw = "\ufeff# my logs\r\n\r\n  a.mcap \r\nruns\nit's # odd.mcap\nn\xe4me.mcap".encode()
    Path("logs.txt").write_bytes(raw)
    expected = ["a.mcap", "runs/b.mcap", "it's # odd.mcap", "n\xe4me.mcap"]
    assert find_logs(["@logs.txt"]) == expected
    assert find_logs(["runs/b.mcap", "@logs.txt"]) == [expected[1], expected[0], *expected[2:]]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(raw)))
    assert find_logs(["@-"]) == expected


def test_a_list_may_name_files_that_are_no_utf8(tree: Tree) -> None:
    name = os.fsdecode(b"caf\xe9.mcap")
    tree(name)
    Path("logs.txt").write_bytes(b"caf\xe9.mcap\n")
    assert find_logs(["@logs.txt"]) == [name]
    assert job_names([name]) == [os.fsdecode(b"caf\xe9")]


@pytest.mark.parametrize(
    ("content", "words", "line"),
    [
        (b"", "found no log in this list", None),
        (b"# nothing\n\n", "found no log in this list", None),
        (b"a.mcap\n@more.txt\n", "found @more.txt, expected a log", 2),
        (b"a.mcap\n\nnone*\n", "none*: found nothing that matches", 3),
        (b"\x89MCAP0\r\n\0\0", "found no text", None),
    ],
)
def test_bad_lists(tree: Tree, content: bytes, words: str, line: int | None) -> None:
    tree("a.mcap")
    Path("logs.txt").write_bytes(content)
    fault = faults_of("@logs.txt")[0]
    assert (fault.file, fault.line) == ("logs.txt", line)
    assert words in fault.message


def test_a_list_that_cannot_be_read(tree: Tree) -> None:
    tree("folder/a.mcap")
    assert "No such file" in faults_of("@none.txt")[0].message
    assert "Is a directory" in faults_of("@folder")[0].message


def test_only_regular_files_are_read(tree: Tree) -> None:
    os.mkfifo("pipe.mcap")
    assert "is not a regular file" in faults_of("pipe.mcap")[0].message
    with pytest.raises(InputFileError, match="is not a regular file"):
        local_copy("pipe.mcap").__enter__()
    with pytest.raises(InputFileError, match="found a folder"):
        local_copy(".").__enter__()


def test_a_local_file_is_its_own_copy(tree: Tree) -> None:
    tree("a.mcap")
    with local_copy("a.mcap") as path:
        assert path == Path("a.mcap")
    with local_copy(f"file://{Path.cwd()}/a.mcap") as path:
        assert path == Path.cwd() / "a.mcap"
    assert Path("a.mcap").exists()


def test_names_are_unique_for_every_file_system() -> None:
    sources = ["a/run.mcap", "b/run.csv", "c/RUN.mcap", "run-2.mcap", "d/run.mcap", "arm.mcap"]
    assert job_names(sources, taken=["ARM"]) == ["run", "run-2", "RUN-3", "run-2-2", "run-4", "arm-2"]
    # One name in two ways of writing it; a Mac takes both for the same file.
    assert job_names(["caf\u00e9.mcap", "cafe\u0301.mcap"]) == ["caf\u00e9", "cafe\u0301-2"]


def test_names_of_odd_sources_are_names_of_files() -> None:
    sources = ["x" * 251 + ".mcap", "x" * 252 + ".csv", "\xe4" * 120 + ".mcap", "..", "/", "a\nb.mcap", "[red] %d.mcap"]
    names = job_names(sources)
    assert len(set(names)) == len(sources)
    # The longest ending of a result, and room for more.
    assert max(len(os.fsencode(f"{name}.collision.parquet")) for name in names) < 255
    assert names[3:] == ["log", "log-2", "a\nb", "[red] %d"]


def test_many_logs_of_one_name_are_named_in_linear_time() -> None:
    # Looking through a list of names would take some 5e9 comparisons for these.
    names = job_names([f"{k}/run.mcap" for k in range(100_000)])
    assert names[0] == "run"
    assert names[-1] == "run-100000"


def test_an_empty_folder_that_is_named_like_a_log_does_not_vanish(tree: Tree) -> None:
    tree("runs/a.mcap", "runs/c.mcap/inner.mcap")
    Path("runs/b.mcap").mkdir()
    found = ["runs/a.mcap", "runs/b.mcap", "runs/c.mcap/inner.mcap"]
    assert find_logs(["runs"]) == find_logs(["runs/*"]) == find_logs(["runs/*.mcap"]) == found
    with pytest.raises(InputFileError, match="found a folder, expected a log"), local_copy("runs/b.mcap"):
        pass
