"""The messages of an MCAP file, block by block; what is damaged is left out and noted."""

from collections.abc import Iterator
from pathlib import Path

from modrob_cli.errors import Fault, InputFileError
from modrob_cli.io.mcap_chunks import Block
from modrob_cli.io.mcap_summary import MAGIC
from modrob_cli.io.mcap_walk import Findings, Walk

_OTHERS = {
    b"\x28\xb5\x2f\xfd": "a file packed with zstd; unpack it first (zstd -d)",
    b"\x1f\x8b": "a file packed with gzip; unpack it first",
    b"SQLite format 3": "an SQLite file (a rosbag2 .db3); convert it with 'ros2 bag convert' or 'mcap convert'",
    b"#ROSBAG": "a ROS 1 bag; convert it with 'mcap convert'",
    b"": "something else",
}
"""What other files begin with, and what to do with them."""


class McapFile(Findings):
    """An MCAP file; its findings are complete once :meth:`blocks` has come to its end."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path

    def blocks(self) -> Iterator[Block]:
        """Messages in the order of the file.

        Raises
        ------
        InputFileError
            If the file cannot be read or is no MCAP file.
        """
        try:
            if self.path.is_dir():
                raise self._error("found a folder, expected an MCAP file; name the .mcap file inside it")
            if not self.path.is_file():
                what = "is not a regular file" if self.path.exists() else "file not found"
                raise self._error(f"{what}; check the path")
            with self.path.open("rb") as stream:
                start = stream.read(16)
                if not start.startswith(MAGIC):
                    what = next(what for magic, what in _OTHERS.items() if start.startswith(magic))
                    raise self._error(f"found {what if start else 'an empty file'}, expected an MCAP file")
                yield from Walk(self, stream, self.path.stat().st_size).blocks()
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
            raise self._error(f"cannot be read: {reason}") from error

    def _error(self, message: str) -> InputFileError:
        return InputFileError(Fault(str(self.path), message))

    def sentences(self) -> list[str]:
        """What is wrong with the file, for people."""
        return self.damage.sentences(self.first_log_time)
