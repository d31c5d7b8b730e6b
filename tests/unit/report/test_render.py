"""Reports as HTML: everything is there, nothing can be injected."""

from html.parser import HTMLParser
from urllib.parse import unquote, urljoin, urlsplit

import pytest

from modrob_cli.report.document import Link, Notes, Picture, Report, Section, Table, Text, Verdict
from modrob_cli.report.render import cell_text, render

EVIL = '<script>alert(1)</script>"&'
SVG = '<?xml version="1.0"?>\n<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0"/></svg>'


class Reader(HTMLParser):
    """Collects tags and text."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.open: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in ("meta", "path", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def report(text: str) -> Report:
    blocks = (
        Table((text, "x"), ((text, 1.23456), (None, 2)), text, {(0, 1): "bad"}),
        Text(text),
        Notes((text,)),
        Picture(SVG, text, text),
    )
    sections = (Section(text, blocks), Section(text, blocks, folded=True))
    return Report(text, text, Verdict("good", text, text), sections, ((text, text),), signature=True)


def test_everything_is_escaped_and_the_page_is_well_formed() -> None:
    reader = Reader()
    html = render(report(EVIL))
    reader.feed(html)
    assert "script" not in reader.tags
    assert reader.open == []
    assert reader.tags.count("svg") == 2
    # title twice, subtitle, verdict twice, provenance twice; each section: heading, two cells and a caption of the
    # table, text, note, caption of the picture
    assert reader.text.count(EVIL) == 7 + 2 * 7
    assert "http" not in html.replace("http-equiv", "").replace('xmlns="http://www.w3.org/2000/svg"', "")


def test_cells() -> None:
    texts = [cell_text(value) for value in (None, 1.23456, 7, True, "a", 1e-9)]
    assert texts == ["–", "1.235", "7", "yes", "a", "1e-09"]


class Links(HTMLParser):
    """Collects the addresses and texts of links."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, str]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "a":
            self.found.append((dict(attrs)["href"] or "", ""))

    def handle_data(self, data: str) -> None:
        if self.found and not self.found[-1][1]:
            self.found[-1] = (self.found[-1][0], data)


NAMES = [
    "a.html",
    "javascript:alert(1)",
    "http:x",
    "a b&c<d>\"'#?%41\\e.html",
    "käse.html",
    "run 2026-03-01T10:00:00.json",
]


@pytest.mark.parametrize("name", NAMES)
def test_link_leads_to_the_file_beside_the_page(name: str) -> None:
    table = Table(("log",), ((Link(EVIL, name),),))
    links = Links()
    links.feed(render(Report("", "", Verdict("open", "", ""), (Section("", (table,)),), ())))
    ((href, text),) = links.found
    assert text == EVIL
    assert urlsplit(href).scheme == ""
    where = urlsplit(urljoin("https://example.org/out/page.html", href))  # as a browser resolves it
    assert (where.netloc, unquote(where.path), where.query, where.fragment) == ("example.org", f"/out/{name}", "", "")


@pytest.mark.parametrize(
    "name", ["", ".", "..", "/etc/passwd", "https://example.org/x", "//example.org", "../x", "a\0b"]
)
def test_link_elsewhere_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="expected the name of a file beside the page"):
        Link("text", name)


def test_columns_of_text_stand_to_the_left_and_numbers_to_the_right() -> None:
    rows = ((None, 1.0, Link("a", "a")), ("text", None, None), ("longer than any text that stays on one line", 2, None))
    html = render(Report("", "", Verdict("open", "", ""), (Section("", (Table(("a", "b", "c"), rows),)),), ()))
    assert '<th class="text">a</th><th>b</th><th class="text">c</th>' in html
    assert '<td class="text">–</td><td>1</td><td class="text"><a href="a">a</a></td>' in html
    assert '<td class="text">text</td><td>–</td><td class="text">–</td>' in html
    assert '<td class="text long">longer' in html


def test_what_nobody_prints_is_left_out_on_paper() -> None:
    sections = (Section("a", (), folded=True, on_paper=False), Section("b", (), folded=True))
    html = render(Report("", "", Verdict("open", "", ""), sections, ()))
    assert html.count('<section class="screen">') == 1
    assert ".screen { display: none; }" in html


def test_names_of_files_that_are_no_utf8() -> None:
    name = b"\xff.html".decode(errors="surrogateescape")
    table = Table(("log",), ((Link(name, name),),))
    html = render(Report("", "", Verdict("open", "", ""), (Section("", (table,)),), ()))
    assert '<a href="%FF.html">\\udcff.html</a>' in html.encode().decode()
