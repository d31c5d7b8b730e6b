"""Whole processes timed from outside, several runs each, beside a reference in the same run."""

import os
import resource
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

MODROB = [str(Path(sys.executable).with_name("modrob"))]
REFERENCE = [sys.executable, "-c", "import numpy"]


@dataclass(frozen=True)
class Timing:
    """Wall time in seconds: fastest, median, slowest; and the peak memory of the largest run in MiB."""

    least: float
    median: float
    most: float
    peak: float


def time_process(command: list[str], runs: int = 5) -> Timing:
    """Run a command ``runs`` times after one warm-up; its output is thrown away.

    Raises
    ------
    subprocess.CalledProcessError
        If a run fails.
    """
    seconds = []
    peak = 0.0
    for k in range(runs + 1):
        start = time.perf_counter()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        elapsed = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise subprocess.CalledProcessError(process.returncode, command)
        peak = max(peak, _mebibytes(usage))
        if k:
            seconds.append(elapsed)
    return Timing(min(seconds), statistics.median(seconds), max(seconds), peak)


def _mebibytes(usage: resource.struct_rusage) -> float:
    """Peak memory; Linux counts kibibytes, macOS bytes."""
    return usage.ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)
