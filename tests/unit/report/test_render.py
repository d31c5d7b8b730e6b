"""Reports as HTML: everything is there, nothing can be injected."""

from html.parser import HTMLParser

from modrob_cli.report.document import Notes, Picture, Report, Section, Table, Text, Verdict
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
