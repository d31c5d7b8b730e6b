"""Reports as HTML."""

from modrob_cli.report.document import Cell, Link, Report, Table

_PLACES = 4
_SHORT = 24
"""Letters of a text that stays on one line in a table."""


def render(report: Report) -> str:
    """One self-contained page: no script, nothing from elsewhere; readable on paper and in dark mode.

    All text is escaped; the drawings are put in as they are.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    loader = PackageLoader("modrob_cli.report", "templates")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.lstrip_blocks = True
    environment.filters["cell"] = cell_text
    environment.filters["kind"] = lambda block: type(block).__name__
    environment.tests["link"] = lambda value: isinstance(value, Link)
    environment.tests["long"] = lambda value: isinstance(value, str | Link) and len(cell_text(value)) > _SHORT
    environment.filters["texts"] = text_columns
    environment.filters["drawing"] = lambda svg: Markup(svg[svg.index("<svg") :])  # without the XML declaration
    page = environment.get_template("report.html.j2").render(report=report)
    # Names of files may hold bytes that are no UTF-8.
    return page.encode(errors="backslashreplace").decode()


def cell_text(value: Cell) -> str:
    """Text of a cell: numbers to four places, a dash for nothing."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Link):
        return value.text
    if isinstance(value, float):
        return f"{value:.{_PLACES}g}"
    return str(value)


def text_columns(table: Table) -> list[bool]:
    """By column, whether its first value that is there is text: those stand to the left, numbers to the right."""
    columns = zip(*table.rows, strict=True) if table.rows else [()] * len(table.header)
    firsts = [next((value for value in column if value is not None), None) for column in columns]
    return [isinstance(value, str | Link) for value in firsts]
