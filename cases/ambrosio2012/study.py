"""The paper's study: two pantographs at several separations, with light and average damping.

``study.toml`` lists the runs, ``variations.py`` reads it, ``statements.py`` judges them,
``figures.py`` redraws the paper's figures 8 to 14, ``ranking.py`` says which open input moves what,
``search.py`` which reading meets most statements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from string import Template
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.cases.ambrosio2012.variations import (
    TABLE,
    VARIED,
    read_table,
    run_name,
    searched,
    variations,
)
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.case_study import StudyRun, StudyVariant
from catenary.cases.studies.sweep.variants import Variant, check_keys

if TYPE_CHECKING:
    from catenary.postproc.read.results import Results
    from catenary.postproc.report.study_report import Study


def variants(scene: Scene, shortened: bool) -> list[StudyVariant]:
    """All runs; only those of the readings that the figures show keep their results."""
    table = read_table(shortened)
    own = scene.train.pantographs[0].name
    planned = []
    for reading in [*table["readings"], *searched(table).values()]:
        for damping, alpha in table["dampings"].items():
            for train in table["trains"]:
                name = run_name(reading["name"], damping, train["name"])
                assignments = (*table["always"], *alpha, *reading["set"], *train["set"])
                keys = {"reading": reading["name"], "damping": damping, "train": train["name"]}
                filled = _with_kind(assignments, reading.get("kind", own))
                shown = reading.get("figures", False)
                planned.append(StudyVariant(Variant(name, filled, keys), shown))
    for title, changes in variations(table).items():
        for damping, alpha in table["dampings"].items():
            name = run_name(VARIED, damping, title)
            keys = {"reading": title, "damping": damping, "train": "single"}
            planned.append(
                StudyVariant(Variant(name, (*table["always"], *alpha, *changes), keys), False)
            )
    check_keys([one.variant for one in planned], f"in {TABLE}")
    _refuse_same_names(planned)
    return planned


def _with_kind(assignments: Sequence[str], kind: str) -> tuple[str, ...]:
    """Assignments with the name of a kind of pantograph in the place of $kind."""
    return tuple(Template(text).safe_substitute(kind=kind) for text in assignments)


def _refuse_same_names(planned: list[StudyVariant]) -> None:
    names = [one.variant.name for one in planned]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{TABLE} makes two runs that are both named {name}")


def measure(results: Results) -> dict[str, Any]:
    """Beside the summary: slack droppers by passage, onset of the uplift, wave and train speed."""
    from catenary.cases.ambrosio2012.measures import measure as take

    return take(results)


def conclude(runs: Mapping[str, StudyRun]) -> Study:
    """Verdicts, ranking and figures of the runs that are done."""
    from catenary.cases.ambrosio2012.conclusion import conclude as draw_up

    return draw_up(runs, read_table())
