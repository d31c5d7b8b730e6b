"""Stop a batch at random instants and go on: ``python -m benchmarks.batch_kills ROBOT LOGS... [--kills 50] OPTIONS``.

Runs ``modrob validate`` undisturbed, then again into another folder, where it gets a random signal (SIGKILL half of the
time; to its whole process group, or to the main process alone) after a random time, and goes on with ``--resume``.
After each kill every visible file has to be one of the undisturbed run, byte by byte (a record may still lack its
pictures); at the end the folders have to be the same.
"""

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.timing import MODROB

SHARE = 1.5
"""A run is stopped after at most two thirds of the time of an undisturbed one: in its middle, most of the time."""
SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGKILL, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def start(command: list[str], out: Path, extra: list[str]) -> "subprocess.Popen[bytes]":
    """A run in a process group of its own, which no signal is kept from (as they are in the background of a shell)."""

    def listen() -> None:
        for number in SIGNALS[3:]:
            signal.signal(number, signal.SIG_DFL)

    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        [*command, "-o", str(out), *extra], stdout=quiet, stderr=quiet, start_new_session=True, preexec_fn=listen
    )


def visible(folder: Path) -> dict[str, bytes]:
    """Files under their final names."""
    if not folder.is_dir():
        return {}
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".modrob")}


def wrong_files(found: dict[str, bytes], expected: dict[str, bytes]) -> list[str]:
    """Files that are not those of the undisturbed run."""
    wrong = []
    for name, content in found.items():
        if content == expected.get(name):
            continue
        record = json.loads(content) if name.endswith(".json") else {}
        if record.get("provenance", {}).get("detailed") is not False:
            wrong.append(name)
    return wrong


def main() -> None:
    """Print what happened; exit code 1 if anything was lost. Where a run comes to its end, the next one starts anew."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("arguments", nargs="+", help="of modrob validate: ROBOT LOG...")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--command", default="validate")
    given, options = parser.parse_known_args()
    command = [*MODROB, given.command, *given.arguments, *[option for option in options if option != "--"]]
    rng, bad = random.Random(given.seed), []
    with tempfile.TemporaryDirectory() as name:
        whole, killed = Path(name, "whole"), Path(name, "killed")
        begin = time.perf_counter()
        code = start(command, whole, []).wait()
        undisturbed = time.perf_counter() - begin
        expected = visible(whole)
        print(f"undisturbed: {undisturbed:.1f} s, exit code {code}, {len(expected)} files", flush=True)
        for k in range(given.kills):
            process = start(command, killed, ["--resume"])
            time.sleep(rng.uniform(0.0, undisturbed / SHARE))
            chosen, group = rng.choice(SIGNALS), rng.random() < 0.5
            with contextlib.suppress(ProcessLookupError):
                (os.killpg if group else os.kill)(process.pid, chosen)
            ended = process.wait()
            found = visible(killed)
            wrong = wrong_files(found, expected)
            bad += wrong
            whom = "group" if group else "alone"
            print(f"{k + 1:3d} {chosen.name} {whom}: exit {ended}, {len(found)} files, wrong: {wrong}", flush=True)
            if ended == code:
                bad += compare(killed, expected)
                shutil.rmtree(killed)
        last = start(command, killed, ["--resume"]).wait()
        bad += compare(killed, expected)
        print(f"resumed to the end: exit code {last}; wrong in all: {bad}")
        if bad or last != code:
            sys.exit(1)


def compare(folder: Path, expected: dict[str, bytes]) -> list[str]:
    """What is not as in the undisturbed run once a run has come to its end."""
    found = visible(folder)
    names = {name for name in {*found, *expected} if found.get(name) != expected.get(name)}
    names |= {path.name for path in folder.iterdir() if path.name.startswith(".modrob")}
    print(f"    came to its end; wrong: {sorted(names)}", flush=True)
    return sorted(names)


if __name__ == "__main__":
    main()
