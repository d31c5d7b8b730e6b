"""Logs behind URLs: what fsspec's file systems in memory, in archives and on a local web server hold."""

import http.server
import io
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from modrob_cli.errors import Fault, InputFileError, NumericalError, UsageError
from modrob_cli.io.log_sources import find_logs, job_names, local_copy

fsspec = pytest.importorskip("fsspec", reason="fsspec is not installed (extra modrob[dask])")


@pytest.fixture
def memory() -> Iterator[Any]:
    files = fsspec.filesystem("memory")
    files.store.clear()
    yield files
    files.store.clear()


def fill(files: Any, *names: str) -> None:
    for name in names:
        files.pipe_file(name, name.encode())


def test_folders_and_patterns_are_listed_by_the_server(memory: Any) -> None:
    fill(memory, "/b/run_10.mcap", "/b/run_2.mcap", "/b/x/run_1.mcap", "/b/t.csv", "/b/.h.mcap", "/b/.h/y.mcap")
    fill(memory, "/b/run_2.collision.mcap")
    runs = ["memory:///b/run_2.mcap", "memory:///b/run_10.mcap"]
    everything = sorted([*runs, "memory:///b/x/run_1.mcap"])
    assert sorted(find_logs(["memory://b"])) == everything
    assert sorted(find_logs(["memory://b/"])) == everything
    assert find_logs(["memory://b/run_*.mcap"])[-2:] == runs
    assert find_logs(["memory://b/x*"]) == ["memory:///b/x/run_1.mcap"]
    assert find_logs(["memory://b/*.csv"]) == ["memory:///b/t.csv"]


def test_a_file_is_taken_as_it_is_without_asking(memory: Any) -> None:
    urls = ["memory://b/none.mcap", "https://[::1]/run.mcap?sign=a*b", "memory://b/none.mcap"]
    pytest.importorskip("aiohttp", reason="fsspec needs aiohttp for web addresses")
    assert find_logs(urls) == urls[:2]


def test_a_name_with_the_signs_of_a_pattern_that_exists_is_no_pattern(memory: Any) -> None:
    fill(memory, "/b/run[1].mcap", "/b/run1.mcap")
    assert find_logs(["memory://b/run[1].mcap"]) == ["memory://b/run[1].mcap"]


def test_nothing_there_is_an_error_with_the_url(memory: Any) -> None:
    memory.mkdir("/empty")
    for url, words in (("memory://b/*.mcap", "found nothing that matches"), ("memory://empty", "in it or below")):
        with pytest.raises(InputFileError, match=words) as caught:
            find_logs([url])
        assert caught.value.faults[0].file == url


def test_a_local_copy_holds_the_bytes_and_goes(memory: Any) -> None:
    content = bytes(range(256)) * 40_000  # more than two blocks
    memory.pipe_file("/b/run.mcap", content)
    with local_copy("memory://b/run.mcap") as path:
        assert path.name == "run.mcap"
        assert path.read_bytes() == content
    assert not path.parent.exists()


def test_a_local_copy_goes_after_an_error_too(memory: Any) -> None:
    fill(memory, "/b/run.csv")
    with pytest.raises(NumericalError), local_copy("memory://b/run.csv") as path:
        raise NumericalError("too short")
    assert not path.parent.exists()


def test_errors_about_the_copy_name_the_url(memory: Any) -> None:
    fill(memory, "/b/run.mcap")
    with pytest.raises(InputFileError) as caught, local_copy("memory://b/run.mcap") as path:
        raise InputFileError([Fault(str(path), "is broken", line=3), Fault("other.csv", "too")])
    assert [fault.file for fault in caught.value.faults] == ["memory://b/run.mcap", "other.csv"]
    assert caught.value.faults[0].line == 3


def test_an_empty_file_is_fetched(memory: Any) -> None:
    memory.pipe_file("/b/run.mcap", b"")
    with local_copy("memory://b/run.mcap") as path:
        assert path.read_bytes() == b""


def test_a_missing_file_fails_when_it_is_read(memory: Any) -> None:
    with pytest.raises(InputFileError, match=r"memory://b/run.mcap: cannot be fetched: there is no such file"):
        local_copy("memory://b/run.mcap").__enter__()


def test_a_transfer_that_ends_early_is_an_error(memory: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A part of an MCAP file can be read, so that nobody would notice."""
    fill(memory, "/b/run.mcap")

    class Cut(io.BytesIO):
        size = 1000

    monkeypatch.setattr(type(memory), "_open", lambda self, path, **options: Cut(b"only the start"))
    with pytest.raises(InputFileError, match="14 of 1000 bytes"):
        local_copy("memory://b/run.mcap").__enter__()


def test_a_full_disk_is_reported(memory: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    fill(memory, "/b/run.mcap")
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    before = Path.open

    def full(path: Path, mode: str = "r", *rest: Any) -> Any:
        return before(Path("/dev/full") if mode == "ab" else path, mode, *rest)

    monkeypatch.setattr(Path, "open", full)
    with pytest.raises(InputFileError, match="No space left on device; set TMPDIR"):
        local_copy("memory://b/run.mcap").__enter__()


def test_urls_that_nobody_knows_are_wrong_usage() -> None:
    with pytest.raises(UsageError, match="found s4://, which fsspec does not know"):
        find_logs(["s4://bucket/run.mcap"])


@pytest.mark.parametrize(("missing", "words"), [("fsspec", r"pip install 'modrob\[dask\]'"), ("s3fs", "s3fs")])
def test_what_is_not_installed_is_named(missing: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    for use in (lambda url: find_logs([url]), lambda url: local_copy(url).__enter__()):
        with pytest.raises(UsageError, match=words):
            use("s3://bucket/run.mcap")


def test_a_local_file_may_look_like_a_url(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("s4:").mkdir()
    Path("s4:/run.mcap").touch()
    assert find_logs(["s4://run.mcap"]) == ["s4://run.mcap"]
    with local_copy("s4://run.mcap") as path:
        assert path.is_file()


def test_names_from_urls() -> None:
    sources = [
        "s3://bucket/runs/run.mcap",
        "https://host/a/run.mcap?signature=secret/x.csv#top",
        "https://host/a%2Fb%00%20c.mcap",
        "http://[::1]:80/d.mcap",
        "https://host/..",
        "memory://",
        "zip://inner/part.csv::s3://bucket/all.zip",
    ]
    assert job_names(sources) == ["run", "run-2", "b_ c", "d", "log", "log-2", "part"]


def test_a_web_server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("aiohttp", reason="fsspec needs aiohttp for web addresses")
    (tmp_path / "run 1.mcap").write_bytes(b"content")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *parts: Any) -> None:
            pass

    monkeypatch.chdir(tmp_path)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        base = f"http://127.0.0.1:{server.server_port}"
        assert find_logs([f"{base}/"]) == [f"{base}/run%201.mcap"]
        with local_copy(f"{base}/run%201.mcap?key=1") as path:
            assert path.read_bytes() == b"content"
            assert path.name == "run 1.mcap"
        with pytest.raises(InputFileError, match="cannot be fetched"):
            local_copy(f"{base}/none.mcap").__enter__()
        server.shutdown()
