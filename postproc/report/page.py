"""A page of sections, as one HTML file that needs no network, and as PDF on A4.

A `Section` has sentences, tables, pictures and folded blocks; sections of a run's report are made
of an `EvaluatedRun`.
"""

from __future__ import annotations

import base64
import functools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.errors import InputError
from catenary.postproc.evaluate import verdict as acceptance
from catenary.postproc.evaluate.error_indicators import Indicators, indicate
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.verdict import Criterion
from catenary.postproc.evaluate.wording import fixed, with_minus
from catenary.postproc.read.results import Results
from catenary.postproc.report.study_table import StudyTable

if TYPE_CHECKING:
    from jinja2 import Template
    from matplotlib.figure import Figure

_TEMPLATES = Path(__file__).parent / "templates"
# A figure with its unit, which stay on one line.
_FIGURE = re.compile(r"(?<=\d) (%|(?:N|kN|mm|m|km|kg|Hz|s|J)(?:/[A-Za-z]{1,2})?)(?![\w/])")
# A unit behind its figure, or in brackets.
_UNIT = re.compile(r"(?<=\xa0)\w+/\w+|\[\w+/\w+\]")
# Cells of tables that are coloured.
_MARKS = {
    "passed": "yes", "failed": "no", "yes": "yes", "no": "no", "?": "unknown",
    "reproduced": "yes", "not reproduced": "no", "cannot be decided": "unknown",
}  # fmt: skip
# A figure is printed this much smaller at most, where it then fits the rest of a sheet [-].
_SMALLEST = 0.8
# Height of a sheet between the margins that the style of the page has, less what rows and headings
# leave that move to the next sheet; height of a caption, which keeps its size [px of CSS].
_SHEET, _CAPTION = (297.0 - 15.0 - 18.0 - 9.0) * 96.0 / 25.4, 28.0
# A sheet on which all of a report has room: it tells how high everything is.
_ENDLESS = "@page { size: 210mm 100000mm !important; }"
# A heading so close above a figure goes with it to the next sheet [px of CSS].
_CLOSE = 60.0


@dataclass(frozen=True)
class EvaluatedRun:
    """A run as sections take it: its results, their statistics and the criteria.

    Attributes
    ----------
    measured : errors of quantities by step and mesh, in their units, where a study measured them
    measured_by : the study
    """

    results: Results
    statistics: RunStatistics
    criteria: Sequence[Criterion] = ()
    measured: Mapping[str, float] = field(default_factory=dict)
    measured_by: str = ""

    @property
    def excitation(self) -> str:
        """What excites the line in place of a train, in words; empty with a train."""
        return str((self.results.attributes.get("excitation") or {}).get("says", ""))

    @cached_property
    def indicators(self) -> Indicators:
        """Estimates of its errors."""
        return indicate(self.results)

    def limit(self, quantity: str) -> float:
        """Smallest limit of a quantity, in its unit; NaN where none is judged."""
        limits = [c.limit for c in self.criteria if c.quantity == quantity and c.limit == c.limit]
        return min(limits, default=float("nan"))

    @property
    def verdict(self) -> bool | None:
        """Whether all criteria are met, None if that is not known."""
        return acceptance.verdict(list(self.criteria))


class Text(NamedTuple):
    """A sentence, or several.

    Attributes
    ----------
    text : sentence or sentences
    look : "good", "bad" or "open" for a verdict, "note" for a box, "remark" for a remark, "code"
        for what is shown to the letter; empty for plain text
    first : words before the text, in bold
    items : a list below it
    """

    text: str
    look: str = ""
    first: str = ""
    items: Sequence[str] = ()


class Picture(NamedTuple):
    """A picture: name of the file without its suffix, caption, and a function that draws the figure
    or returns None; without one it is made before the page."""

    name: str
    caption: str
    draw: Callable[[], Figure | None] = lambda: None


class Folded(NamedTuple):
    """Folded block: a title, and a text or table that a reader unfolds."""

    title: str
    block: Text | StudyTable


class Section(NamedTuple):
    """A section of a report, in the order of its parts.

    Attributes
    ----------
    heading : empty for what stands below the title of the page
    blocks : texts and tables; made when the page is, such as by a generator
    pictures : of the section, as far as the run has them
    folded : blocks of details
    """

    heading: str
    blocks: Iterable[Text | StudyTable]
    pictures: Iterable[Picture] = ()
    folded: Iterable[Folded] = ()


class SectionEntry(NamedTuple):
    """An entry of a report's list of sections.

    Attributes
    ----------
    name : of the section, an anchor of the page
    make : returns the section of a run
    applies : whether a run has anything to show there; the section is left out otherwise
    full : whether it stands in full reports alone, because it takes long
    """

    name: str
    make: Callable[[EvaluatedRun], Section]
    applies: Callable[[EvaluatedRun], bool] = lambda run: True
    full: bool = False


def has_train(run: EvaluatedRun) -> bool:
    """Whether pantographs run along the line, and not an excitation without a train."""
    return not run.excitation


def number(value: Any, digits: int = 1) -> str:
    """``value`` with so many decimals, a dash for NaN and None."""
    return "–" if value is None or value != value else fixed(value, digits)


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
    environment.filters["commands"] = _with_commands
    environment.filters["unit_whole"] = _with_whole_unit
    return environment.get_template("page.html.j2")


def _whole(text: str) -> str:
    """HTML in which no line ends between a figure and its unit, or within the unit."""
    return _UNIT.sub(r'<span class="unit">\g<0></span>', _FIGURE.sub("\N{NO-BREAK SPACE}\\1", text))


def _with_commands(text: Any) -> Any:
    """A sentence as HTML, in which what stands between back quotes is a command."""
    from markupsafe import Markup, escape

    words = str(escape(with_minus(str(text)))).split("`")
    return Markup("".join(f"<code>{w}</code>" if n % 2 else _whole(w) for n, w in enumerate(words)))


def _with_whole_unit(head: str) -> Any:
    """The head of a column as HTML, in which no line ends within the unit."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"\[.*\]", r"<span>\g<0></span>", str(escape(head))))


def _data_uri(data: bytes) -> str:
    kind = "png" if data.startswith(b"\x89PNG") else "svg+xml"
    return f"data:image/{kind};base64," + base64.b64encode(data).decode("ascii")


def pdf(html: str) -> bytes:
    """A page as PDF on A4, with page numbers and bookmarks. Not collective.

    A figure that just misses the rest of a sheet is printed smaller, and does not leave it white.

    Parameters
    ----------
    html : str
        What ``page`` returned; what is folded away there is not printed.

    Raises
    ------
    InputError
        If the package WeasyPrint or a library that it needs is missing.
    """
    CSS, HTML, URLFetcher = _weasyprint()
    fetcher = URLFetcher(allowed_protocols=["data"])  # pictures are in the page
    cache: dict[str, Any] = {}  # of pictures, which are laid out twice
    document = HTML(string=html, url_fetcher=fetcher)
    # Folded parts are not printed; without them large tables are laid out in a third.
    for folded in document.etree_element.iter("details"):
        folded[:] = folded.findall("summary")
    figures = list(document.etree_element.iter("figure"))
    for n, figure in enumerate(figures):
        figure.set("id", f"figure-{n}")
    layout = document.render(stylesheets=[CSS(string=_ENDLESS)], cache=cache)
    tops = {name: (box[1], box[3]) for name, box in layout.pages[0].anchors.items()}
    boxes = [tops.pop(figure.get("id")) for figure in figures]
    found = shares(boxes, [top for top, _ in tops.values()])
    for figure, share in zip(figures, found, strict=True):
        figure.set("style", f"--share: {share:.3f}")
    return bytes(document.write_pdf(cache=cache))


def shares(figures: Sequence[tuple[float, float]], headings: Sequence[float]) -> list[float]:
    """Size of each figure over its usual one, so that few sheets end early. Not collective.

    Parameters
    ----------
    figures : sequence of tuple of float
        Top and bottom of each figure in order, on an endless sheet that begins at the first heading
        [px of CSS].
    headings : sequence of float
        Tops of the headings there [px of CSS].
    """
    found = []
    at, last = 0.0, min(headings, default=0.0)  # on the sheet, on the endless one
    for top, bottom in figures:
        at = (at + top - last) % _SHEET
        height, room = bottom - top, _SHEET - at
        share = min((room - _CAPTION) / (height - _CAPTION), 1.0)
        if share < _SMALLEST:
            close = [top - heading for heading in headings if 0.0 < top - heading < _CLOSE]
            at, share = min(close, default=0.0), 1.0
        at += share * (height - _CAPTION) + _CAPTION
        last = bottom
        found.append(share)
    return found


def refuse_without_pdf() -> None:
    """Raise `InputError` if no PDF can be written. Not collective."""
    _weasyprint()


def _weasyprint() -> tuple[Any, Any, Any]:
    try:
        from weasyprint import CSS, HTML
        from weasyprint.urls import URLFetcher
    except (ImportError, OSError) as error:  # OSError: of Pango, which is no package of Python
        raise InputError(
            f"--pdf needs the package weasyprint and the library Pango ({error}): pip install "
            "'catenary[report]', and on Debian apt-get install libpango-1.0-0 libpangoft2-1.0-0"
        ) from error
    return CSS, HTML, URLFetcher
