"""Throughput and memory of a batch: ``python -m benchmarks.batch_speed ROBOT LOGS... [--jobs 1 2] OPTIONS``.

Runs ``modrob validate`` (or ``--command``) with each number of processes, in turns, and prints logs per second of the
work on the logs and of the whole command, the peak of the resident memory of the main process and of each worker (from
/proc, so Linux only), and whether the outputs are the same bytes.
"""

import argparse
import hashlib
import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

from benchmarks.timing import MODROB


def peaks(group: int) -> dict[int, int]:
    """Peak resident memory [kB] by process of a process group."""
    found = {}
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and os.getpgid(int(entry.name)) == group:
                status = (entry / "status").read_text()
                found[int(entry.name)] = int(re.search(r"VmHWM:\s+(\d+)", status)[1])  # type: ignore[index]
        except (OSError, TypeError):
            continue  # it has ended meanwhile
    return found


def digest(folder: Path) -> str:
    """Of all names and contents."""
    found = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        found.update(path.name.encode() + path.read_bytes())
    return found.hexdigest()[:12]


def run(command: list[str], out: Path) -> str:
    """One run; a line of the table."""
    begin = time.perf_counter()
    highest: dict[int, int] = {}
    with tempfile.TemporaryFile("w+") as told:
        process = subprocess.Popen(
            [*command, "-o", str(out)], stderr=told, stdout=subprocess.DEVNULL, start_new_session=True
        )
        while process.poll() is None:
            highest |= {pid: max(value, highest.get(pid, 0)) for pid, value in peaks(process.pid).items()}
            time.sleep(0.05)
        told.seek(0)
        said = told.read()
    seconds = time.perf_counter() - begin
    total, work = re.findall(r"(\d+)/\1 logs, .*?, (.*?) passed", said)[-1]
    main = highest.pop(process.pid) / 1024
    workers = sorted((value / 1024 for value in highest.values()), reverse=True)
    listed = ", ".join(f"{value:.0f}" for value in workers[:4]) or "-"
    return (
        f"{total} logs: work {work}, whole command {seconds:6.1f} s, exit code {process.returncode}; peak MB: main"
        f" {main:.0f}, others {listed}; outputs {digest(out)}"
    )


def main() -> None:
    """Print a line for each run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("arguments", nargs="+", help="ROBOT LOG...")
    parser.add_argument("--command", default="validate")
    parser.add_argument("--jobs", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--rounds", type=int, default=3)
    given, options = parser.parse_known_args()
    for _ in range(given.rounds):
        for jobs in given.jobs:
            with tempfile.TemporaryDirectory() as name:
                command = [*MODROB, given.command, *given.arguments, *options, "-j", str(jobs)]
                print(f"-j {jobs}: {run(command, Path(name, 'out'))}", flush=True)


if __name__ == "__main__":
    main()
