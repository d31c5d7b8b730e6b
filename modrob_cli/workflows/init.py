"""A workspace for a new user."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from modrob_cli.errors import OutputExistsError
from modrob_cli.io.outputs import OutputFolder
from modrob_cli.io.shipped import SHIPPED_FOLDERS, shipped_contents

README = """\
# A modrob workspace

    modules/        what a module is: geometry, bodies, joints (module/1), one folder per catalogue
    assemblies/     modules bolted together (assembly/1), and arms given by a D-H table (robot/1)
    trajectories/   planned motions
    scenarios/      what happens in simulated runs, and a controller in Python

Check everything, then build a model of the six-axis arm:

    modrob check .
    modrob assemble assemblies/lwa4p-6.yaml -o out

To add a module of your own, copy one that is like it (modules/scara/inner-arm.yaml is a short one), change the numbers
and the name, and run `modrob check` on it. All units are SI; angles may be written as pi/2 or 90 deg. A number that is
not known exactly becomes {nominal: 3.9, tol: 5%} or {nominal: 3.9, min: 3.7, max: 4.1}. Then copy an assembly and list
your module in it; `catalogue` is the path from the assembly to the modules. `modrob schema module/1` prints a JSON
Schema that editors use to complete keys.
"""


@dataclass(frozen=True)
class Workspace:
    """A workspace that was laid out, and its files relative to it."""

    folder: Path
    files: list[Path]


def init(folder: Path, overwrite: bool = False) -> Workspace:
    """Copy the shipped data and a README into a folder; all files or none.

    Raises
    ------
    OutputExistsError
        Naming the files that exist, unless ``overwrite`` is true.
    UsageError
        If the folder cannot be written.
    """
    contents = {Path("README.md"): README.encode()}
    for name in SHIPPED_FOLDERS:
        contents |= {Path(name) / file: content for file, content in shipped_contents(name).items()}
    _refuse_existing(folder, list(contents), overwrite)
    with ExitStack() as stack:
        folders = {
            part: stack.enter_context(OutputFolder(folder / part, overwrite))
            for part in sorted({file.parent for file in contents})
        }
        for file, content in contents.items():
            folders[file.parent].write(file.name, content)
    return Workspace(folder, sorted(contents))


def _refuse_existing(folder: Path, files: list[Path], overwrite: bool) -> None:
    there = [str(folder / file) for file in files if (folder / file).exists()]
    if there and not overwrite:
        shown = ", ".join(there[:3]) + (f" and {len(there) - 3} more" if len(there) > 3 else "")
        raise OutputExistsError(f"{shown}: exists already; choose another folder, or pass --overwrite to replace it")
