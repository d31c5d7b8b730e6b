"""How logs are read."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from modrob_cli.model.log import TimeSource


@dataclass(frozen=True)
class LogOptions:
    """How logs are read.

    Attributes
    ----------
    topic : topic of the joint states; None if there is only one
    joint_map : names of joints in the log and what the robot calls them
    time : which times count
    strict : refuse damaged files instead of using what can be read
    publisher : which of several publishers on the topic, from 1; None if there is only one
    """

    topic: str | None = None
    joint_map: Mapping[str, str] = field(default_factory=dict)
    time: TimeSource = "header"
    strict: bool = False
    publisher: int | None = None
