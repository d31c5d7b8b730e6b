"""What of an MCAP file could not be read."""

from dataclasses import dataclass, field

_KEPT = 50
"""Losses that are listed one by one; a file that is damaged all over has more."""


class DamageError(ValueError):
    """Bytes are not what they should be; the message says why."""


@dataclass
class Loss:
    """One damaged place.

    Attributes
    ----------
    offset, size : where it is and how many bytes cannot be used
    reason : in words
    messages : messages lost there; None if the file does not tell
    start, end : log times of what is lost, [ns]; None if the file does not tell
    """

    offset: int
    size: int
    reason: str
    messages: int | None = None
    start: int | None = None
    end: int | None = None


@dataclass
class Damage:
    """All damaged places of a file.

    Attributes
    ----------
    losses : the first of them
    count, size : number of places and sum of their bytes
    cut : True if the file ends before its end mark
    missing : messages that the summary counts beyond those that were read or are known to be lost
    """

    losses: list[Loss] = field(default_factory=list)
    count: int = 0
    size: int = 0
    cut: bool = False
    missing: int = 0

    def __bool__(self) -> bool:
        """Whether anything is wrong."""
        return bool(self.count or self.cut or self.missing)

    def add(self, loss: Loss) -> Loss:
        """Count a loss and keep it if it is among the first."""
        self.count += 1
        self.size += loss.size
        if len(self.losses) < _KEPT:
            self.losses.append(loss)
        return loss

    def sentences(self, origin: int | None = None) -> list[str]:
        """What is wrong, for people; times count from ``origin`` [ns], the first log time."""
        out = ["the file ends in the middle: it was cut, or its recording was not finished"] if self.cut else []
        out += [_sentence(loss, origin) for loss in self.losses[:5]]
        if self.count > 5:
            out.append(f"and {self.count - 5} more damaged places, {self.size} bytes in all")
        if self.missing:
            out.append(f"{self.missing} messages that the summary of the file counts are not there")
        return out

    def record(self) -> dict[str, object]:
        """Plain data for JSON."""
        losses = [
            {
                "offset": loss.offset,
                "bytes": loss.size,
                "reason": loss.reason,
                "messages": loss.messages,
                "log_time": None if loss.start is None or loss.end is None else [loss.start / 1e9, loss.end / 1e9],
            }
            for loss in self.losses
        ]
        return {
            "cut": self.cut,
            "places": self.count,
            "bytes": self.size,
            "missing_messages": self.missing,
            "losses": losses,
        }


def _sentence(loss: Loss, origin: int | None) -> str:
    text = f"at byte {loss.offset}: {loss.reason}"
    lost = [f"{loss.messages} messages"] if loss.messages else []
    lost += [f"{loss.size} bytes"] if loss.size else []
    if lost:
        text += f"; lost: {', '.join(lost)}"
    if lost and loss.start is not None and loss.end is not None and origin is not None:
        text += f", from {(loss.start - origin) / 1e9:.6g} s to {(loss.end - origin) / 1e9:.6g} s of the recording"
    return text
