"""Acceptance of the run in a result file, by the rule books that it names."""

from __future__ import annotations

from catenary.base.errors import InputError
from catenary.postproc.evaluate.observations import observe
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.verdict import Criterion, judge, quantities_of, verdict_sentence
from catenary.postproc.read.results import Results
from catenary.postproc.standards.book import Conditions, RuleBook
from catenary.postproc.standards.library import DEFAULT, book_named, books_of_entries
from catenary.postproc.standards.quantities import KMH

_STOPS = "uplift_stops"  # the effect by which steady arms have stops


def books_of(results: Results) -> list[RuleBook]:
    """The rule books of a run; of a file without them the edition of EN 50367 that it names.

    Raises
    ------
    InputError
        If it names none.
    """
    about = results.attributes
    if about.get("rules"):
        return books_of_entries(about["rules"])
    if about.get("edition"):
        return [book_named(f"{DEFAULT}:{about['edition']}")]
    raise InputError(f"{results.path} does not say by which rules its run is judged")


def criteria_of(results: Results, statistics: RunStatistics) -> list[Criterion]:
    """All criteria of a run's rule books. Not collective."""
    books, about = books_of(results), results.attributes
    stops = any(name == _STOPS for name, *_ in about["effects_on"])
    conditions = Conditions(KMH * results.fact("speed"), about["system"], stops)
    observations = observe(quantities_of(books), results, statistics)
    names = [p.name for p in statistics.pantographs]
    return judge(books, observations, conditions, about.get("limits") or {}, names)


def judged_by(results: Results, criteria: list[Criterion]) -> str:
    """Sentence on books, editions and supply that judge a run, with counts of verdicts."""
    return verdict_sentence(criteria, results.attributes["system"])
