"""Motions from CSV whose samples may lack accelerations, or velocities too: ``t,q1..qN[,dq1..dqN[,ddq1..ddqN]]``."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.given_motion import MOST_POINTS, GivenMotion
from modrob_cli.io.motion_csv import NumberTable, open_csv, read_header
from modrob_cli.io.motion_header import column_order, count_of, joints_of, kinds_of
from modrob_cli.model.trajectory_points import MotionPoints


def read_motion_csv(path: Path, joint_names: Sequence[str] | None) -> GivenMotion:
    """Samples of a motion; times are counted from the first one.

    Parameters
    ----------
    joint_names : joints of the robot, whose columns are then required; None: those that the header has

    Raises
    ------
    InputFileError
        If the file cannot be read, its columns do not fit, something in it is not a finite number, its times do not
        increase, or it has fewer than two samples or too many.
    """
    file = str(path)
    with open_csv(path) as stream:
        header = read_header(file, stream)
        kinds, named = kinds_of(header), joints_of(header)
        names = joint_names if joint_names is not None else named or [str(k) for k in range(count_of(header))]
        order = column_order(file, header, names, kinds)
        table, parts, count = NumberTable(file, header), [], 0
        for lines, values in table.blocks(stream):
            part = values[:, order]
            table.check_times(lines, part[:, 0])
            parts.append(part)
            count += len(part)
            if count > MOST_POINTS:
                message = f"found more than {MOST_POINTS} samples, expected fewer for a curve through them"
                advice = "'modrob bounds' takes long motions with accelerations as they are; or leave out samples"
                raise InputFileError(Fault(file, f"{message}; {advice}"))
    if count < 2:
        raise InputFileError(Fault(file, f"found {count} samples, expected two or more"))
    rows = np.concatenate(parts)
    n, start = len(names), float(rows[0, 0])
    columns = [rows[:, 1 + k * n : 1 + (k + 1) * n] for k in range(len(kinds))]
    dq, ddq = [*columns[1:], None, None][:2]
    points = MotionPoints(rows[:, 0] - start, columns[0], dq, ddq, tuple(names) if named else None)
    notes = (f"the first time is {start:.9g} s; times are counted from there",) if start != 0.0 else ()
    return GivenMotion(points, "samples", Fault(file, "", line=1), notes)
