"""A page of sections as one HTML file that needs no network, with its pictures in it."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from pathlib import Path

from catenary.postproc.report.sections.section import Section

_TEMPLATES = Path(__file__).parent / "templates"
# Cells of tables that are coloured.
_MARKS = {
    "passed": "yes", "failed": "no", "on": "yes", "yes": "yes", "no": "no", "?": "unknown",
    "reproduced": "yes", "not reproduced": "no", "cannot be decided": "unknown",
}  # fmt: skip


def page(title: str, lead: str, sections: Iterable[Section], pictures: Mapping[str, bytes]) -> str:
    """The page as text; sections are made as it is written. Not collective.

    Parameters
    ----------
    title, lead : above the sections
    pictures : PNG files by name; sections show those that are there
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    uris = {
        name: "data:image/png;base64," + base64.b64encode(data).decode("ascii")
        for name, data in pictures.items()
    }
    return environment.get_template("page.html.j2").render(
        title=title, lead=lead, sections=sections, uris=uris, marks=_MARKS
    )
