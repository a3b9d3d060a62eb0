"""A page of sections as one HTML file that needs no network, with its pictures in it."""

from __future__ import annotations

import base64
import functools
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.postproc.evaluate.wording import with_minus
from catenary.postproc.report.sections.section import Section

if TYPE_CHECKING:
    from jinja2 import Template

_TEMPLATES = Path(__file__).parent / "templates"
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=%|(?:N|mm|m|km/h|Hz|s)\b)")
# Cells of tables that are coloured.
_MARKS = {
    "passed": "yes", "failed": "no", "yes": "yes", "no": "no", "?": "unknown",
    "reproduced": "yes", "not reproduced": "no", "cannot be decided": "unknown",
}  # fmt: skip


def page(
    title: str,
    lead: str,
    sections: Iterable[Section],
    pictures: Mapping[str, bytes],
    names: Sequence[str] = (),
    plots: Mapping[str, str] | None = None,
    script: str = "",
) -> str:
    """The page as text; sections are made as it is written. Not collective.

    Parameters
    ----------
    title, lead : str
        Heading of the page, and the sentence below it.
    sections : iterable of Section
        Sections in their order.
    pictures : mapping
        PNG or SVG files by name; sections show those that are there.
    names : sequence of str, optional
        Names of the sections, as their anchors and for a list of contents; none without both.
    plots : mapping, optional
        Pictures of Plotly in JSON by name, which stand in the place of others.
    script : str, optional
        Program of Plotly.
    """
    made = list(sections)
    uris = {name: _data_uri(data) for name, data in pictures.items()}
    return _template().render(
        title=title,
        lead=lead,
        sections=list(zip(made, names or [""] * len(made), strict=True)),
        uris=uris,
        marks=_MARKS,
        # A text of a picture must not end the element that it stands in.
        plots={name: text.replace("</", "<\\/") for name, text in (plots or {}).items() if text},
        script=script,
    )


@functools.cache
def _template() -> Template:
    """The template of all pages, compiled once."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["minus"] = lambda value: with_minus(str(value))
    environment.filters["commands"] = _with_commands
    return environment.get_template("page.html.j2")


def _with_commands(text: str) -> Any:
    """A sentence as HTML, in which what stands between back quotes is a command."""
    from markupsafe import Markup, escape

    # A figure stays on the line of its unit.
    words = _BEFORE_UNIT.sub("\u00a0", str(escape(with_minus(text)))).split("`")
    return Markup("".join(f"<code>{w}</code>" if n % 2 else w for n, w in enumerate(words)))


def _data_uri(data: bytes) -> str:
    kind = "png" if data.startswith(b"\x89PNG") else "svg+xml"
    return f"data:image/{kind};base64," + base64.b64encode(data).decode("ascii")
