"""What a report is made of, before it has a form."""

import os
from dataclasses import dataclass, field
from typing import Literal
from urllib.parse import quote

Tone = Literal["good", "bad", "open", "plain"]


@dataclass(frozen=True)
class Link:
    """Text that leads to a file beside the page.

    Attributes
    ----------
    href : name of the file. It is percent-encoded whole, colons too, so that no name can be taken for another site or
        for a script: ``javascript:x`` leads to a file of that name
    """

    text: str
    href: str

    def __post_init__(self) -> None:
        if self.href in ("", ".", "..") or "/" in self.href or "\0" in self.href:
            raise ValueError(f"found a link to {self.href!r}, expected the name of a file beside the page")

    @property
    def address(self) -> str:
        """What goes into the page; it holds letters, digits and ``%-._~`` only."""
        return quote(os.fsencode(self.href), safe="")


Cell = str | float | int | Link | None


@dataclass(frozen=True)
class Verdict:
    """The answer, and what it covers.

    Attributes
    ----------
    tone : good and bad are answers, open means that nobody asked for one
    headline : a sentence
    scope : what the answer is about and what it is not
    """

    tone: Tone
    headline: str
    scope: str


@dataclass(frozen=True)
class Table:
    """Rows of text and numbers.

    Attributes
    ----------
    caption : units and what to look for
    tones : by row and column, cells that stand out
    """

    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    tones: dict[tuple[int, int], Tone] = field(default_factory=dict)


@dataclass(frozen=True)
class Picture:
    """An SVG drawing of our own (it is put into the page as it is), with words for those who do not see it."""

    svg: str
    caption: str
    alternative: str


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Notes:
    """A list of remarks."""

    items: tuple[str, ...]


Block = Table | Picture | Text | Notes


@dataclass(frozen=True)
class Section:
    """A heading and what is under it; a folded one shows its blocks on request and on paper.

    Attributes
    ----------
    on_paper : false for what nobody prints, such as a table of a thousand logs
    """

    title: str
    blocks: tuple[Block, ...]
    folded: bool = False
    on_paper: bool = True


@dataclass(frozen=True)
class Report:
    """A whole report.

    Attributes
    ----------
    provenance : label and value: versions, options, hashes
    signature : leave room for a name, a date and a signature
    """

    title: str
    subtitle: str
    verdict: Verdict
    sections: tuple[Section, ...]
    provenance: tuple[tuple[str, str], ...]
    signature: bool = False
