"""Documents as files hold them: pydantic models that mirror the YAML, each with ``to_model()``."""

from modrob_cli.schema.assembly import AssemblyDocument
from modrob_cli.schema.base import Document
from modrob_cli.schema.module import ModuleDocument
from modrob_cli.schema.robot import RobotDocument
from modrob_cli.schema.scenario import ScenarioDocument
from modrob_cli.schema.task import TaskDocument
from modrob_cli.schema.trajectory import TrajectoryDocument

DOCUMENTS: dict[str, type[Document]] = {
    "module/1": ModuleDocument,
    "assembly/1": AssemblyDocument,
    "robot/1": RobotDocument,
    "trajectory/1": TrajectoryDocument,
    "task/1": TaskDocument,
    "scenario/1": ScenarioDocument,
}
"""Document kinds by the value of their first key ``modrob``."""

__all__ = [
    "DOCUMENTS",
    "AssemblyDocument",
    "Document",
    "ModuleDocument",
    "RobotDocument",
    "ScenarioDocument",
    "TaskDocument",
    "TrajectoryDocument",
]
