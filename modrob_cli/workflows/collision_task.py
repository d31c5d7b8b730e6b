"""``modrob collision`` for one log: its numbers, table, MCAP, picture and page."""

from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

from modrob_cli import __version__
from modrob_cli.batch.jobs import LogJob, TaskKey
from modrob_cli.io.outputs import OutputFolder, sha256
from modrob_cli.plot.collision import draw_collision
from modrob_cli.report.render import render
from modrob_cli.workflows.collision_banding import Learned
from modrob_cli.workflows.collision_drawing import Drawing
from modrob_cli.workflows.collision_files import SeriesFiles
from modrob_cli.workflows.collision_judge import Watcher, judge_stream
from modrob_cli.workflows.collision_load import open_run
from modrob_cli.workflows.collision_options import CollisionOptions
from modrob_cli.workflows.collision_report import collision_page
from modrob_cli.workflows.collision_result import SCOPE, learned_json, log_result
from modrob_cli.workflows.robots import LoadedRobot


@dataclass(frozen=True)
class CollisionTask:
    """Judge one log or planned motion; files NAME.collision.csv and .mcap, and .png and a page if detailed.

    Attributes
    ----------
    learned : by the training runs, the same for all logs; None without any
    inputs : hashes of the files of the robot, of the training runs and of the planned motion
    page : name of the page if there is only one log; None for NAME.collision.html
    """

    loaded: LoadedRobot
    options: CollisionOptions
    learned: Learned | None
    inputs: dict[str, str]
    page: str | None = None
    command: str = "collision"

    def key(self) -> TaskKey:
        """Robot, planned motion, training runs and options."""
        reading = self.options.reading
        more = {
            "reading": [dict(reading.joint_map), reading.time, reading.strict, reading.publisher],
            "filter": astuple(self.options.filter),  # its text has fewer digits
            "compare": self.options.compare,
            "page": self.page,
        }
        return TaskKey(self.inputs, {**self.options.data, **more})

    def run(self, job: LogJob, path: Path, folder: OutputFolder, detailed: bool) -> dict[str, Any]:
        """Judge it.

        Raises
        ------
        InputFileError
            If the log cannot be used.
        UsageError
            If the options do not fit it.
        NumericalError
            If a band is not finite, or a filter does not fit the log.
        """
        robot, options, stem = self.loaded.robot, self.options, f"{job.name}.collision"
        with open_run(robot, path, job.name, options) as stream:
            drawing = Drawing(stream, options) if detailed else None
            files = SeriesFiles(stream, options, folder.stage(f"{stem}.csv"), folder.stage(f"{stem}.mcap"))
            with files:
                watchers: list[Watcher] = [files.add] if drawing is None else [files.add, drawing.add]
                judged = judge_stream(stream, options, self.learned, watchers)
        result = {**log_result(judged, options), "source": job.label}
        result["page"] = (self.page or f"{stem}.html") if detailed else None
        result["picture"] = f"{stem}.png" if detailed else None
        record = {**collision_head(self, [result]), "logs": [result]}
        if drawing is not None:
            picture = drawing.picture(judged)
            draw_collision(picture, folder.stage(f"{stem}.png"))
            inputs = {**self.inputs, job.file: f"sha256:{sha256(path)}"}
            folder.write(result["page"], render(collision_page(judged, picture, record, inputs, options, __version__)))
        return record


def collision_head(task: CollisionTask, results: list[dict[str, Any]]) -> dict[str, Any]:
    """What the result says of some logs together."""
    measured = [result for result in results if not result["planned"]]
    return {
        "robot": task.loaded.robot.name,
        "collision": any(result["events"] for result in measured) if measured else None,
        "scope": SCOPE,
        "options": task.options.data,
        "learned": learned_json(task.loaded.robot, task.learned, task.options),
    }
