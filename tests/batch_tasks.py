"""Small tasks over text files, for tests of how many logs are handled; processes import them by name."""

import os
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from modrob_cli.batch.jobs import LogJob, TaskKey
from modrob_cli.errors import Fault, InputFileError, NumericalError
from modrob_cli.io.outputs import OutputFolder


@dataclass(frozen=True)
class UpperCase:
    """Writes the text in capitals; what the text says decides what goes wrong."""

    options: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    command: str = "upper"

    def key(self) -> TaskKey:
        return TaskKey({"robot.yaml": "sha256:0"}, self.options)

    def run(self, job: LogJob, path: Path, folder: OutputFolder, detailed: bool) -> dict[str, Any]:
        text = path.read_text()
        folder.write(f"{job.name}.upper.txt", text.upper())
        if self.seconds:
            time.sleep(self.seconds)
        if "unreadable" in text:
            raise InputFileError(Fault(str(path), "found nonsense"))
        if "singular" in text:
            raise NumericalError("no convergence")
        if "bug" in text:
            raise ZeroDivisionError("by zero")
        if "die" in text:
            os.kill(os.getpid(), signal.SIGKILL)
        if "full" in text:
            raise OSError(28, "No space left on device")
        if detailed:
            folder.write(f"{job.name}.upper.page.txt", f"page of {text}")
        return {"log": job.source, "length": len(text), "third": 1.0 / 3.0}
