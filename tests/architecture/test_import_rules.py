"""The rules of the house: who imports whom, who opens files, who prints; and a quick start."""

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "modrob_cli"
FILES = sorted(PACKAGE.rglob("*.py"))

BOTTOM = {"errors", "arrays"}
ALGORITHMS = {"assembly", "identify", "scaling", "collision", "simulate"}
BELOW: dict[str, set[str]] = {
    "__init__": set(),
    "errors": set(),
    "arrays": {"errors"},
    "interval": BOTTOM,
    "spatial": BOTTOM,
    "model": BOTTOM | {"interval", "spatial"},
    "dynamics": BOTTOM | {"interval", "spatial", "model"},
    **{room: BOTTOM | {"interval", "spatial", "model", "dynamics"} for room in ALGORITHMS},
    "schema": BOTTOM | {"interval", "spatial", "model"},
    "io": BOTTOM | {"interval", "spatial", "model", "schema", "__init__"},
    "plot": BOTTOM | {"interval", "spatial", "model"},
    "report": BOTTOM | {"interval", "spatial", "model"},
    "batch": BOTTOM | {"io", "__init__"},
}
BELOW["workflows"] = set(BELOW) - {"__init__"} | {"__init__"}
BELOW["cli"] = {"workflows", "batch", "schema", "io", "__init__"} | BOTTOM
"""Rooms that a room may import, itself left out. cli also takes document kinds and angles from schema, and what
ships with the tool from io, and options and outcomes of a batch."""

HEAVY = {"matplotlib", "pinocchio", "scipy", "mcap", "mcap_ros2", "rich", "pyarrow", "distributed", "fsspec"}
OPENERS = {
    "open",
    "read_text",
    "read_bytes",
    "write_text",
    "write_bytes",
    "mkdir",
    "unlink",
    "rmdir",
    "rename",
    "touch",
}
LONGEST = 300


def room_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imports(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and full name of every module that is imported anywhere in the tree; relative imports are refused."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            module = node.module or ""
            if module == "modrob_cli":
                yield from ((node.lineno, f"modrob_cli.{alias.name}") for alias in node.names)
            else:
                yield node.lineno, module


def at_import(tree: ast.Module) -> Iterator[ast.stmt]:
    """Statements that run at import, ``if TYPE_CHECKING`` left out."""
    waiting: list[ast.stmt] = list(tree.body)
    while waiting:
        node = waiting.pop(0)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            waiting.extend(node.orelse)
            continue
        yield node
        for inner in ast.iter_child_nodes(node):
            if isinstance(inner, ast.stmt):
                waiting.append(inner)


def type_only(tree: ast.Module) -> set[int]:
    """Lines of the imports under ``if TYPE_CHECKING``."""
    blocks = [node for node in ast.walk(tree) if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)]
    return {line for block in blocks for line, _ in imports(block)}


def needed_room(module: str) -> str | None:
    """The room that an import needs; None for other packages."""
    parts = module.split(".")
    if parts[0] != "modrob_cli":
        return None
    if len(parts) > 1 and ((PACKAGE / parts[1]).is_dir() or (PACKAGE / f"{parts[1]}.py").is_file()):
        return parts[1]
    return "__init__"


def where(path: Path, line: int, what: str) -> str:
    return f"{path.relative_to(PACKAGE.parent)}:{line}: {what}"


def test_every_room_is_known() -> None:
    assert {room_of(path) for path in FILES} - {"__main__"} <= set(BELOW)


def test_rooms_import_only_what_lies_below() -> None:
    broken = []
    for path in FILES:
        room = room_of(path)
        tree = tree_of(path)
        for_types = type_only(tree) if room == "cli" else set()  # annotations may name what workflows pass through
        for line, module in imports(tree):
            needed = needed_room(module)
            if line not in for_types and needed not in (None, room) and needed not in BELOW.get(room, set()):
                broken.append(where(path, line, f"{room} imports {needed}"))
    assert not broken, "\n".join(broken)


def test_only_io_opens_files() -> None:
    broken = []
    for path in FILES:
        if room_of(path) in ("io", "cli"):
            continue
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Call):
                function = node.func
                name = function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")
                if name in OPENERS:
                    broken.append(where(path, node.lineno, f"calls {name}()"))
    assert not broken, "\n".join(broken)


def test_only_plot_imports_matplotlib_and_never_pyplot() -> None:
    broken = [
        where(path, line, f"imports {module}")
        for path in FILES
        for line, module in imports(tree_of(path))
        if module.split(".")[0] == "matplotlib" and (room_of(path) != "plot" or "pyplot" in module)
    ]
    assert not broken, "\n".join(broken)


def test_heavy_libraries_are_imported_where_they_are_used() -> None:
    broken = []
    for path in FILES:
        for node in at_import(tree_of(path)):
            if isinstance(node, ast.Import | ast.ImportFrom):
                heavy = [module for _, module in imports(node) if module.split(".")[0] in HEAVY]
                broken += [where(path, node.lineno, f"imports {module} at import") for module in heavy]
    assert not broken, "\n".join(broken)


@pytest.mark.parametrize(
    ("library", "rooms"), [("typer", {"cli"}), ("pydantic", {"schema", "io", "workflows", "cli"}), ("yaml", {"io"})]
)
def test_libraries_stay_in_their_rooms(library: str, rooms: set[str]) -> None:
    broken = [
        where(path, line, f"imports {module}")
        for path in FILES
        for line, module in imports(tree_of(path))
        if module.split(".")[0] == library and room_of(path) not in rooms
    ]
    assert not broken, "\n".join(broken)


def test_nothing_below_cli_prints_or_exits() -> None:
    broken = []
    for path in FILES:
        if room_of(path) == "cli":
            continue
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in (
                "print",
                "sys.exit",
                "exit",
                "quit",
                "os._exit",
            ):
                broken.append(where(path, node.lineno, f"calls {ast.unparse(node.func)}"))
            if isinstance(node, ast.Attribute) and ast.unparse(node) in ("sys.stdout", "sys.stderr"):
                broken.append(where(path, node.lineno, f"uses {ast.unparse(node)}"))
    assert not broken, "\n".join(broken)


def test_files_are_short() -> None:
    lengths = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    assert not {str(path): length for path, length in lengths.items() if length > LONGEST}


def loaded_by(statement: str) -> set[str]:
    """Top-level names of the modules that a fresh interpreter holds after a statement."""
    code = f"{statement}\nimport json, sys\nprint(json.dumps([name.split('.')[0] for name in sys.modules]))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    return set(json.loads(done.stdout))


def test_starting_the_command_loads_nothing_heavy() -> None:
    found = loaded_by("import modrob_cli.cli.app")
    assert "typer" in found
    assert not found & {"numpy", "pydantic", "yaml", *HEAVY}


def test_checking_a_document_loads_no_plots_and_no_robot_library(workspace: Path) -> None:
    found = loaded_by(
        f"from pathlib import Path\nfrom modrob_cli.workflows.check import check\ncheck([Path({str(workspace)!r})])"
    )
    assert "numpy" in found
    assert not found & HEAVY
