"""Recordings of real robots that are not part of the repository; tests that need them are skipped without."""

from pathlib import Path

import pytest

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


def shared(name: str) -> Path:
    """Path of a file or folder of the shared data; skips the test if it is not there."""
    path = SHARED_DATA / name
    if not path.exists():
        pytest.skip(f"shared data not present: ../shared/data/{name}")
    return path
