"""The options that commands over many logs share, in a command of their own."""

from typing import Any

import pytest
import typer
from typer.testing import CliRunner, Result

from modrob_cli.batch.jobs import DETAILS, BatchOptions
from modrob_cli.cli.app import ModrobGroup
from modrob_cli.cli.batch_options import Dask, Details, Jobs, KeepGoing, Logs, Resume, batch_options
from modrob_cli.cli.options import Overwrite


def run(*arguments: str) -> tuple[Result, BatchOptions | None]:
    found: list[Any] = []
    app = typer.Typer(cls=ModrobGroup, rich_markup_mode=None)

    @app.callback()
    def main() -> None:
        pass

    @app.command("work")
    def work(
        logs: Logs,
        jobs: Jobs = None,
        resume: Resume = False,
        keep_going: KeepGoing = True,
        dask: Dask = None,
        details: Details = None,
        overwrite: Overwrite = False,
    ) -> None:
        found.append(batch_options(jobs, resume, keep_going, dask, details, overwrite))

    result = CliRunner().invoke(app, ["work", *arguments])
    return result, found[0] if found else None


def test_left_out_options_leave_the_choice_to_the_batch() -> None:
    assert run("a.mcap", "b")[1] == BatchOptions(None, False, False, None, DETAILS)


def test_all_options_arrive() -> None:
    assert run("a", "-j", "3", "--resume", "--fail-fast", "--details", "0")[1] == BatchOptions(3, True, True, None, 0)
    assert run("a", "--keep-going", "--dask", "tcp://h:8786")[1] == BatchOptions(dask="tcp://h:8786")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-j", "0"], "Invalid value for '--jobs' / '-j'"),
        (["-j", "-2"], "Invalid value for '--jobs' / '-j'"),
        (["-j", "2.5"], "Invalid value for '--jobs' / '-j'"),
        (["--details", "-1"], "Invalid value for '--details'"),
        (["--resume", "--overwrite"], "--resume keeps results and --overwrite replaces them"),
        (["--dask", "tcp://h:1", "-j", "2"], "--jobs is for this machine"),
        (["--dask", " "], "found an empty address"),
    ],
)
def test_contradictions_and_nonsense_are_wrong_usage(arguments: list[str], words: str) -> None:
    result, found = run("a.mcap", *arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.output.replace("│", " ").split())
    assert found is None


def test_without_logs_there_is_nothing_to_do() -> None:
    assert run()[0].exit_code == 2


def test_help_says_which_logs() -> None:
    text = " ".join(run("--help")[0].output.split())
    assert "folders (all *.mcap in and below)" in text
    assert "--keep-going" in text
    assert "--fail-fast" in text
