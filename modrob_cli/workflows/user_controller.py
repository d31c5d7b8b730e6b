"""Controllers by name: shipped ones, and a user's own in a Python file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.python_controller import RAISED, controller_file, describe, first_line, load_factory, raised_fault
from modrob_cli.simulate.controllers.interface import Controller, ControlTask, Desired
from modrob_cli.simulate.controllers.shipped import make_controller

EXPECTED = "an object with a method torque(t, q, dq, desired)"


def load_user_controller(name: str, task: ControlTask) -> Controller:
    """Make the controller of ``FILE.py`` or ``FILE.py:NAME``, or a shipped one.

    The file is run each time, so that nothing is left of earlier runs.

    Raises
    ------
    InputFileError
        If the file cannot be used.
    UsageError
        If the name is neither a Python file nor a shipped controller, or gains are missing or wrong.
    """
    found = controller_file(name)
    if found is None:
        return make_controller(name, task)
    path, factory_name = found
    return UserController(path, load_factory(path, factory_name), task)


class UserController:
    """Calls a user's controller with copies of the state, and checks what comes back.

    Parameters
    ----------
    path : file that the code is from, for messages
    factory : makes the controller from the task

    Raises
    ------
    InputFileError
        If the factory raises, or makes something without a method ``torque``.
    UsageError
        As the task raises it, for gains.
    """

    def __init__(self, path: Path, factory: Callable[[Any], Any], task: ControlTask) -> None:
        self._path = path
        self._names = task.model.robot.joint_names
        try:
            self._controller = factory(task)
            self._torque = getattr(self._controller, "torque", None)
        except UsageError:
            raise  # says which gain is missing or wrong, and where to give it
        except RAISED as error:
            raise InputFileError(raised_fault(path, error, "while the controller was made", factory)) from error
        if not callable(self._torque):
            made = f"the controller is of type {type(self._controller).__name__} without a method torque"
            raise InputFileError(Fault(str(path), f"{made}, expected {EXPECTED}", line=first_line(factory, path)))

    def torque(self, t: float, q: Array, dq: Array, desired: Desired) -> Array:
        """See :class:`~modrob_cli.simulate.controllers.interface.Controller`.

        Raises
        ------
        InputFileError
            If the user's code raises, or gives something else than one finite number for each joint.
        """
        when = f"at t = {t:.6g} s"
        copies = Desired(*(np.array(part) for part in desired))
        try:
            result = self._torque(t, np.array(q), np.array(dq), copies)  # type: ignore[misc]
        except UsageError:
            raise
        except RAISED as error:
            raise InputFileError(raised_fault(self._path, error, when, self._torque)) from error
        return self._checked(result, when)

    def _checked(self, result: Any, when: str) -> Array:
        n = len(self._names)
        if result is None:
            raise self._wrong("torque gave nothing; is a return missing?", when)
        try:
            values = np.asarray(result)
        except RAISED as error:
            raise self._wrong(f"torque gave no array ({describe(error)}), expected {n} numbers", when) from error
        if values.dtype.kind not in "fiu":
            raise self._wrong(f"torque gave values of type {values.dtype}, expected {n} real numbers", when)
        if values.shape != (n,):
            raise self._wrong(f"torque gave an array of shape {values.shape}, expected ({n},), one per joint", when)
        bad = [f"{name}: {value}" for name, value in zip(self._names, values, strict=True) if not np.isfinite(value)]
        if bad:
            raise self._wrong(f"torque gave {', '.join(bad)}; expected finite numbers", when)
        return values.astype(float)

    def _wrong(self, message: str, when: str) -> InputFileError:
        return InputFileError(Fault(str(self._path), f"{message} ({when})", line=first_line(self._torque, self._path)))
