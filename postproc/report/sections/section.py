"""Parts of a section of a report: sentences, tables, pictures, folded blocks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.postproc.evaluate import verdict as acceptance
from catenary.postproc.evaluate.error_indicators import Indicators, indicate
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.verdict import Criterion
from catenary.postproc.evaluate.wording import fixed
from catenary.postproc.read.results import Results
from catenary.postproc.report.study_table import StudyTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
