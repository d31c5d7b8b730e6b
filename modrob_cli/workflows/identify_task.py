"""``modrob identify`` for one of several logs: its own fit, and what the fit of all together needs to be planned."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.batch.jobs import LogJob, TaskKey
from modrob_cli.errors import NumericalError
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.model.log import JointLog
from modrob_cli.model.robot import Robot
from modrob_cli.workflows.identify_fit import fit_all
from modrob_cli.workflows.identify_options import IdentifyOptions
from modrob_cli.workflows.identify_runs import own_cutoff, read_log, split_run
from modrob_cli.workflows.identify_summary import fit_entry, glitch_notes, log_facts, part_facts
from modrob_cli.workflows.robots import LoadedRobot

Record = dict[str, Any]


@dataclass(frozen=True)
class IdentifyTask:
    """Fit one log alone, with its own cut-off; no files but the record.

    Attributes
    ----------
    inputs : hashes of the files of the robot
    """

    loaded: LoadedRobot
    options: IdentifyOptions
    inputs: dict[str, str]
    command: str = "identify"

    def key(self) -> TaskKey:
        """Robot and options of reading and fitting."""
        reading = self.options.reading
        how = [reading.joint_map, reading.time, reading.strict, reading.publisher]
        return TaskKey(self.inputs, {**self._options(), "reading": how})

    def run(self, job: LogJob, path: Path, folder: OutputFolder, detailed: bool) -> Record:
        """Fit it; a log that is too short for a fit of its own has a record that says so.

        Raises
        ------
        InputFileError
            If the log cannot be read.
        UsageError
            If an option does not fit it.
        """
        robot, options = self.loaded.robot, self.options
        log, record = look(robot, job, path, options)
        try:
            parts = split_run(robot, log, options, record["signals"]["cutoff"])
            record |= part_facts(parts)
            record["notes"] += glitch_notes(parts.whole)
            record["fit"] = fit_entry(robot, fit_all(robot, [parts], options.regression, diagnose=False))
        except NumericalError as error:
            record["notes"].append(f"no fit of its own: {error}")
        return {**record, "options": self._options()}

    def _options(self) -> dict[str, Any]:
        """Those that decide the fit of one log."""
        return {key: value for key, value in self.options.data.items() if key != "max_nrmse"}


def look(robot: Robot, job: LogJob, path: Path, options: IdentifyOptions) -> tuple[JointLog, Record]:
    """Read a log and tell what it is, and which cut-off suits it; errors as for :func:`read_log`."""
    log = read_log(robot, path, options, job.name)
    choice = own_cutoff(log, options)
    signals = {
        "cutoff": choice.cutoff,
        "rule": choice.reason,
        "bandwidth": [float(x) if np.isfinite(x) else None for x in choice.bandwidth],
    }
    about = {"robot": robot.name, "log": job.label, "name": job.name}
    return log, {**about, **log_facts(log), "signals": signals, "fit": None}
