"""The paper's study: two pantographs at several separations, with light and average damping.

``study.toml`` lists the runs, ``statements.py`` judges them, ``figures.py`` redraws the paper's
figures 8 to 14, ``ranking.py`` says which open input moves what, ``search.py`` which reading meets
most statements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from catenary.cases.scene.input.toml_input import read_toml
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.case_study import StudyRun, StudyVariant
from catenary.cases.studies.sweep.variants import Variant, check_keys, slug
from catenary.solver.base.errors import InputError

if TYPE_CHECKING:
    from catenary.postproc.read.results import Results
    from catenary.postproc.report.study_report import Study

TABLE = Path(__file__).with_name("study.toml")
VARIED = "vary"
SEARCHED = "search"


def run_name(reading: str, damping: str, train: str) -> str:
    """Name of the run of a train under a reading."""
    return slug(f"{reading}__{damping}__{train}")


def variations(table: Mapping[str, Any]) -> dict[str, list[str]]:
    """Assignments of all variations by "group: title"."""
    return _by_title(table["variations"])


def searched(table: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The readings of the search by "input: option", each one option off the one searched around.

    Empty if the latter is not among the readings.
    """
    search = table["search"]
    return {
        title: {**centre, "name": f"{SEARCHED}-{title}", "set": [*centre["set"], *assignments],
                "figures": False}
        for centre in table["readings"]
        if centre["name"] == search["around"]
        for title, assignments in _by_title(search["inputs"]).items()
    }  # fmt: skip


def _by_title(groups: Mapping[str, Mapping[str, list[str]]]) -> dict[str, list[str]]:
    return {
        f"{group}: {title}": assignments
        for group, entries in groups.items()
        for title, assignments in entries.items()
    }


def read_table(shortened: bool = False) -> dict[str, Any]:
    """``study.toml``, reduced to its short form on request."""
    table = read_toml(TABLE)
    if shortened:
        short = table["short"]
        for name in ("trains", "readings"):
            table[name] = [one for one in table[name] if one["name"] in short[name]]
        table["variations"] = _chosen(table["variations"], short["variations"])
        table["search"]["inputs"] = _chosen(table["search"]["inputs"], short["search"])
    return table


def _chosen(groups: Mapping[str, Any], titles: Sequence[str]) -> dict[str, dict[str, list[str]]]:
    kept: dict[str, dict[str, list[str]]] = {}
    for group, title in (name.split(": ") for name in titles):
        kept.setdefault(group, {})[title] = groups[group][title]
    return kept


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
