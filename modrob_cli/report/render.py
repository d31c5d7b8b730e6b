"""Reports as HTML."""

from modrob_cli.report.document import Cell, Report

_PLACES = 4


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
    environment.filters["drawing"] = lambda svg: Markup(svg[svg.index("<svg") :])  # without the XML declaration
    return environment.get_template("report.html.j2").render(report=report)


def cell_text(value: Cell) -> str:
    """Text of a cell: numbers to four places, a dash for nothing."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.{_PLACES}g}"
    return str(value)
