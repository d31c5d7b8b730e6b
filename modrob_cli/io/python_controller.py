"""A user's own controller: a Python file that is run, and faults in it at their lines."""

import difflib
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from modrob_cli.errors import Fault, InputFileError, UsageError
from modrob_cli.io.yaml_loader import read_text

FACTORY = "make_controller"
"""What makes the controller where the user names nothing."""

RAISED = (Exception, SystemExit)
"""What a user's code may raise and modrob reports; an interrupt from the keyboard passes."""

_FILE = re.compile(r"(?P<path>.*\.py)(?::(?P<name>[^:/\\]*))?\Z", re.DOTALL)
_LONGEST = 500


def controller_file(text: str) -> tuple[Path, str] | None:
    """Path and name of ``FILE.py`` or ``FILE.py:NAME``; None for the name of a shipped controller.

    Raises
    ------
    UsageError
        If NAME cannot be a name in Python.
    """
    match = _FILE.match(text)
    if match is None:
        return None
    name = FACTORY if match["name"] is None else match["name"]
    if not name.isidentifier():
        raise UsageError(
            f"controller: found {ascii(text)}, expected FILE.py or FILE.py:NAME with the name of a function"
        )
    return Path(match["path"]), name


def compile_controller(path: Path) -> CodeType:
    """Read and compile a Python file, without running it.

    Raises
    ------
    InputFileError
        If it cannot be read or is not Python.
    """
    text = read_text(path)
    try:
        return compile(text, str(path), "exec", dont_inherit=True)
    except SyntaxError as error:
        message = f"not valid Python: {error.msg}"
        raise InputFileError(Fault(str(path), message, line=error.lineno, column=error.offset or None)) from error
    except (ValueError, RecursionError, MemoryError) as error:
        raise InputFileError(Fault(str(path), f"not valid Python: {describe(error)}")) from error


def load_factory(path: Path, name: str = FACTORY) -> Callable[[Any], Any]:
    """Run a Python file and return what makes the controller in it: a function or class that takes one argument.

    Modules beside the file can be imported at its top.

    Raises
    ------
    InputFileError
        If the file cannot be read or compiled, raises, or has no such function.
    """
    code = compile_controller(path)
    module = ModuleType(f"modrob_controller_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses and pickle look there
    try:
        with _neighbours(path):
            exec(code, module.__dict__)
    except RAISED as error:
        raise InputFileError(raised_fault(path, error, "while it was loaded")) from error
    if name not in module.__dict__:
        raise InputFileError(Fault(str(path), _nothing_of_that_name(module, name)))
    factory = module.__dict__[name]
    if not callable(factory):
        message = f"found {name} of type {type(factory).__name__}, expected a function or class that makes a controller"
        raise InputFileError(Fault(str(path), message))
    return factory  # type: ignore[no-any-return]


@contextmanager
def _neighbours(path: Path) -> Iterator[None]:
    """Let the file import what lies beside it; last, so that it cannot hide other modules."""
    folder = str(path.parent.absolute())
    sys.path.append(folder)
    try:
        yield
    finally:
        sys.path.remove(folder)


def _nothing_of_that_name(module: ModuleType, name: str) -> str:
    own = [
        key
        for key, value in module.__dict__.items()
        if callable(value) and getattr(value, "__module__", None) == module.__name__
    ]
    close = difflib.get_close_matches(name, own, n=1)
    there = f"it defines {', '.join(own[:10])}" if own else "it defines no function"
    hint = f"; did you mean FILE.py:{close[0]}?" if close else "; another one is named with FILE.py:NAME"
    return f"{name} is missing, expected 'def {name}(task)'; {there}{hint if own else ''}"


def raised_fault(path: Path, error: BaseException, when: str, called: object = None) -> Fault:
    """Fault for what a user's code raised, at the innermost line of the user's file that was running.

    Parameters
    ----------
    when : such as ``at t = 0.1 s``
    called : what was called; its first line counts where the call itself failed
    """
    line = None
    trace = error.__traceback__
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == str(path):
            line = trace.tb_lineno
        trace = trace.tb_next
    return Fault(str(path), f"{describe(error)} ({when})", line=line or first_line(called, path))


def first_line(function: object, path: Path) -> int | None:
    """Line where a function, a method or the initialiser of a class begins, if it is in the file."""
    candidates = (getattr(function, "__func__", function), getattr(function, "__init__", None))
    codes = (getattr(candidate, "__code__", None) for candidate in candidates)
    lines = (code.co_firstlineno for code in codes if code is not None and code.co_filename == str(path))
    return next(lines, None)


def describe(error: BaseException) -> str:
    """Type and text of an exception, bounded in length."""
    try:
        text = str(error)
    except RAISED:
        text = "an exception without text"
    shown = text if len(text) <= _LONGEST else text[:_LONGEST] + "..."
    return f"{type(error).__name__}: {shown}" if shown else type(error).__name__
