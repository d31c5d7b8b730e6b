"""``modrob validate`` for one log: its numbers, CSV, picture and page."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from modrob_cli.batch.jobs import LogJob, TaskKey
from modrob_cli.io.long_log import is_long
from modrob_cli.io.outputs import OutputFolder, sha256
from modrob_cli.report.render import render
from modrob_cli.workflows.robots import LoadedRobot
from modrob_cli.workflows.validate_files import draw_log, write_series
from modrob_cli.workflows.validate_judge import friction_from, judge_log
from modrob_cli.workflows.validate_long import judge_long
from modrob_cli.workflows.validate_long_files import LongPage
from modrob_cli.workflows.validate_options import ValidateOptions
from modrob_cli.workflows.validate_report import validation_page
from modrob_cli.workflows.validate_result import SCOPES, log_result, passed


@dataclass(frozen=True)
class ValidateTask:
    """Judge one log; files NAME.validate.csv, and .png and a page if detailed.

    Attributes
    ----------
    inputs : hashes of the files of the robot
    page : name of the page if there is only one log; None for NAME.validate.html
    """

    loaded: LoadedRobot
    options: ValidateOptions
    inputs: dict[str, str]
    page: str | None = None
    command: str = "validate"

    def key(self) -> TaskKey:
        """Robot and options."""
        reading = self.options.reading
        options = {**self.options.data, "reading": [reading.joint_map, reading.time, reading.strict, reading.publisher]}
        return TaskKey(self.inputs, {**options, "page": self.page})

    def run(self, job: LogJob, path: Path, folder: OutputFolder, detailed: bool) -> dict[str, Any]:
        """Judge it; errors as for :func:`judge_log`."""
        stem, friction = f"{job.name}.validate", friction_from(self.loaded.robot, self.options)
        page = (self.page or f"{stem}.html") if detailed else None
        if is_long(path):
            about = None if page is None else LongPage(page, self.inputs)
            result = judge_long(self.loaded, job.name, job.label, path, self.options, folder, about)
        else:
            result = self._judge(job, path, folder, page)
        result["name"] = job.name
        result["page"] = page
        result["picture"] = f"{stem}.png" if detailed else None
        head = {"passed": passed([result], []), "friction": friction, "scope": SCOPES[friction]}
        return {**head, "skipped": [], "options": self.options.data, "logs": [result]}

    def _judge(self, job: LogJob, path: Path, folder: OutputFolder, page: str | None) -> dict[str, Any]:
        """Judge a log that fits into memory."""
        robot, stem = self.loaded.robot, f"{job.name}.validate"
        friction = friction_from(robot, self.options)
        log = judge_log(self.loaded, path, self.options)
        result = log_result(robot, job.label, log, self.options)
        write_series(robot, log, folder.stage(f"{stem}.csv"))
        if page is not None:
            draw_log(robot, job.name, log, friction, folder.stage(f"{stem}.png"))
            head = {"passed": passed([result], []), "friction": friction, "scope": SCOPES[friction]}
            inputs = {**self.inputs, job.file: f"sha256:{sha256(path)}"}
            folder.write(page, render(validation_page(robot, log, result, head, inputs, self.options)))
        return result
