"""The data that modrob brings along: catalogue, assemblies, trajectories, scenarios."""

from pathlib import Path

from modrob_cli.errors import ModrobError

SHIPPED_FOLDERS = ("modules", "assemblies", "trajectories", "scenarios")


def shipped_folder(name: str) -> Path:
    """Folder of shipped data: inside the package when installed from a wheel, at the root in a checkout.

    Parameters
    ----------
    name : one of SHIPPED_FOLDERS

    Raises
    ------
    ModrobError
        If the installation does not have it.
    """
    package = Path(__file__).resolve().parents[1]
    candidates = (package / "shipped" / name, package.parent / name)
    for folder in candidates:
        if folder.is_dir():
            return folder
    places = " or ".join(str(folder) for folder in candidates)
    raise ModrobError(f"the shipped data are missing, expected {places}; install modrob again")


def shipped_files(name: str) -> list[Path]:
    """Files of a shipped folder relative to it, sorted; hidden ones left out."""
    folder = shipped_folder(name)
    files = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return sorted(file for file in files if not any(part.startswith(".") for part in file.parts))


def shipped_contents(name: str) -> dict[Path, bytes]:
    """Contents of the files of a shipped folder by their path relative to it."""
    folder = shipped_folder(name)
    return {file: (folder / file).read_bytes() for file in shipped_files(name)}
