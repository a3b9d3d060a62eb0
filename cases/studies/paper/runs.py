"""The runs of a paper's study, as its ``study.toml`` lists them, and their figures.

A *reading* is one choice of what the paper leaves open. Under each one all *trains* run with all
*dampings*. *Variations* change one input of the case, with the first train alone; the *search*
changes one input of a reading, with all trains.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.case_study import StudyRun, StudyVariant
from catenary.cases.studies.sweep.variants import Variant, check_keys, slug
from catenary.postproc.report.study_table import Column

VARIED, SEARCHED = "vary", "search"
_TABLES = ("title", "lead", "always", "dampings", "trains", "readings", "statements", "ranking",
           "variations", "search", "short")  # fmt: skip
LEADING, TRAILING, SINGLE = "leading", "trailing", "single"
_SUMMARY = ("mean_N", "std_N", "max_N", "min_N", "loss_percent", "std_0_5_N", "std_5_20_N")
# Figures of a pantograph of a run, with which statements are judged and which tables show: forces
# below 20 Hz in the stretch, losses of the force as it is. Those of the second part are of the run.
_OF_PANTOGRAPH = (
    Column("mean_N", "mean [N]", ".1f"),
    Column("std_N", "std [N]", ".1f"),
    Column("std_percent", "std / mean [%]", ".1f"),
    Column("max_N", "max [N]", ".1f"),
    Column("min_N", "min [N]", ".1f"),
    Column("loss_percent", "loss [%]", ".1f"),
    Column("std_0_5_N", "0-5 Hz [N]", ".1f"),
    Column("std_5_20_N", "5-20 Hz [N]", ".1f"),
    Column("amplitude_N", "max - min [N]", ".1f"),
    Column("over_leading_N", "max - min, less the leading one's [N]", "+.1f"),
    Column("over_alone_percent", "std over that of one alone [%]", "+.1f"),
)
_OF_RUN = (
    Column("uplift_mm", "arm uplift [mm]", ".1f"),
    Column("onset_m", "head to the arm when its uplift begins [m]", ".1f"),
    Column("slack", "slack at mid-span", "d"),
    Column("slack_before", "slack at mid-span, before the trailing one", "d"),
    Column("slack_after", "slack at mid-span, under and after the trailing one", "d"),
    Column("wave_speed_km_h", "wave speed [km/h]", ".1f"),
    Column("speed_over_wave", "speed over wave speed", ".3f"),
)
FIGURES = {column.name: column for column in (*_OF_PANTOGRAPH, *_OF_RUN)}
OF_RUN = frozenset(column.name for column in _OF_RUN)
Figures = dict[str, Any]


@dataclass(frozen=True)
class Rows:
    """Figures of all pantographs of a reading.

    Attributes
    ----------
    rows : of each, ``damping``, ``train``, ``place`` and ``FIGURES`` by name, None if unknown
    missing : ``damping`` and ``train`` of runs that broke or have no statistics
    """

    rows: Sequence[Figures]
    missing: Sequence[Mapping[str, str]] = ()

    @classmethod
    def of(cls, runs: Mapping[tuple[str, str], Sequence[Figures] | None]) -> Rows:
        """Rows by damping and train, each of the leading pantograph on, None without a run.

        What follows from the others is added: ratios, and comparisons of pantographs.
        """
        rows: list[Figures] = []
        for (damping, train), own in runs.items():
            places = (SINGLE,) if own and len(own) == 1 else (LEADING, TRAILING)
            for place, one in zip(places, own or (), strict=False):
                rows.append({**one, "damping": damping, "train": train, "place": place})
        alone = {row["damping"]: row["std_N"] for row in rows if row["place"] == SINGLE}
        lead: dict[tuple[str, str], float] = {}
        for row in rows:
            row["std_percent"] = 100.0 * row["std_N"] / row["mean_N"]
            row["amplitude_N"] = row["max_N"] - row["min_N"]
            run, single = (row["damping"], row["train"]), alone.get(row["damping"])
            lead.setdefault(run, row["amplitude_N"])
            row["over_leading_N"] = row["amplitude_N"] - lead[run]
            row["over_alone_percent"] = single and 100.0 * (row["std_N"] / single - 1.0)
            row["slack"] = row["slack_before"] + row["slack_after"]
        missing = [
            {"damping": damping, "train": train}
            for (damping, train), own in runs.items()
            if own is None
        ]
        return cls(rows, missing)

    def only(self, trains: Sequence[str]) -> Rows:
        """The rows of some trains."""
        rows = [row for row in self.rows if row["train"] in trains]
        return Rows(rows, [run for run in self.missing if run["train"] in trains])

    def at(self, figure: str, **where: str) -> list[float]:
        """Known values of a figure where rows have these words."""
        return [
            row[figure]
            for row in self.rows
            if row[figure] is not None and all(row[key] == word for key, word in where.items())
        ]


def name_of(row: Mapping[str, Any]) -> str:
    """Train and place of a pantograph."""
    return str(row["train"] if row["place"] == SINGLE else f"{row['train']} {row['place']}")


@dataclass(frozen=True)
class PaperStudy:
    """A study by its table.

    Attributes
    ----------
    path : of the ``study.toml``
    table : its content, in the short form on request
    """

    path: Path
    table: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path, shortened: bool = False) -> PaperStudy:
        """The study of a file. Raises InputError if it cannot be read or lacks a table."""
        table = read_toml(path)
        if lacks := [name for name in _TABLES if name not in table]:
            raise InputError(f"{path} has no {lacks[0]}; a study needs {', '.join(_TABLES)}")
        if shortened:
            short = table["short"]
            for name in ("trains", "readings"):
                table[name] = [one for one in table[name] if one["name"] in short[name]]
            table["variations"] = _chosen(table["variations"], short["variations"])
            table["search"]["inputs"] = _chosen(table["search"]["inputs"], short["search"])
        return cls(path, table)

    @property
    def dampings(self) -> list[str]:
        """Names of the dampings."""
        return list(self.table["dampings"])

    @property
    def trains(self) -> list[str]:
        """Names of the trains, the single pantograph's first."""
        return [train["name"] for train in self.table["trains"]]

    @property
    def named_trains(self) -> list[str]:
        """Names of the trains that the paper's text names."""
        return [train["name"] for train in self.table["trains"] if train.get("named_in_text")]

    def variations(self) -> dict[str, list[str]]:
        """Assignments of all variations by "group: title"."""
        return _by_title(self.table["variations"])

    def searched(self) -> dict[str, dict[str, Any]]:
        """The readings of the search by "input: option", each one option off its centre.

        Empty if that is not among the readings.
        """
        search = self.table["search"]
        return {
            title: {**centre, "name": f"{SEARCHED}-{title}", "set": [*centre["set"], *assignments],
                    "figures": False}
            for centre in self.table["readings"]
            if centre["name"] == search["around"]
            for title, assignments in _by_title(search["inputs"]).items()
        }  # fmt: skip

    def variants(self, scene: Scene) -> list[StudyVariant]:
        """All runs; only those of the readings that the figures show keep their results."""
        own, always = scene.train.pantographs[0].name, self.table["always"]
        planned = []
        for reading in [*self.table["readings"], *self.searched().values()]:
            for damping, alpha in self.table["dampings"].items():
                for train in self.table["trains"]:
                    words = (*always, *alpha, *reading["set"], *train["set"])
                    keys = {
                        "reading": reading["name"], "damping": damping, "train": train["name"]
                    }  # fmt: skip
                    variant = Variant(
                        run_name(*keys.values()), _filled(words, reading.get("kind", own)), keys
                    )
                    planned.append(StudyVariant(variant, reading.get("figures", False)))
        for title, changes in self.variations().items():
            for damping, alpha in self.table["dampings"].items():
                keys = {"reading": title, "damping": damping, "train": self.trains[0]}
                name = run_name(VARIED, damping, title)
                planned.append(StudyVariant(Variant(name, (*always, *alpha, *changes), keys)))
        check_keys([one.variant for one in planned], f"in {self.path}")
        names = [one.variant.name for one in planned]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{self.path} makes two runs that are both named {name}")
        return planned

    def rows(self, runs: Mapping[str, StudyRun], reading: str) -> Rows:
        """Figures of a reading's runs, of those that were planned."""
        return Rows.of({
            (damping, train): figures_of(runs[name])
            for damping in self.dampings
            for train in self.trains
            if (name := run_name(reading, damping, train)) in runs
        })  # fmt: skip

    def rows_of_variations(self, runs: Mapping[str, StudyRun]) -> Iterator[tuple[str, Rows]]:
        """Title and figures of each variation that was planned."""
        for title in self.variations():
            names = {damping: run_name(VARIED, damping, title) for damping in self.dampings}
            if all(name in runs for name in names.values()):
                yield title, Rows.of({
                    (damping, self.trains[0]): figures_of(runs[name])
                    for damping, name in names.items()
                })  # fmt: skip


def run_name(reading: str, damping: str, train: str) -> str:
    """Name of the run of a ``train`` under a ``reading``, with one of the ``damping``s of the
    study."""
    return slug(f"{reading}__{damping}__{train}")


def changes_of(reading: Mapping[str, Any]) -> list[str]:
    """Changes of the case by a reading, its kind of pantograph included, as assignments."""
    kind = [f"train.pantographs.0.name={reading['kind']}"] if "kind" in reading else []
    return [*kind, *reading["set"]]


def figures_of(run: StudyRun | None) -> list[Figures] | None:
    """Figures of each pantograph of a run, the leading one first; None without statistics."""
    if run is None or not run.ended.done:
        return None
    summary, measured = run.ended.summary, run.ended.measured
    uplift, slack = summary["supports"]["max_uplift_mm"], measured["slack"]["mid"]
    forces = [{name: one[name] for name in _SUMMARY} for one in summary["pantographs"]]
    if uplift is None or any(value is None for one in forces for value in one.values()):
        return None
    wave, speed = measured["wave_speed_m_per_s"], measured["train_speed_m_per_s"]
    of_run = {
        "uplift_mm": uplift,
        "onset_m": measured["onset_m"],
        "slack_before": slack["leading"],
        "slack_after": slack["trailing"],
        "wave_speed_km_h": 3.6 * wave,
        "speed_over_wave": speed / wave,
    }
    return [one | of_run for one in forces]


def _filled(assignments: Sequence[str], kind: str) -> tuple[str, ...]:
    """Assignments with the name of a kind of pantograph in the place of $kind."""
    return tuple(Template(text).safe_substitute(kind=kind) for text in assignments)


def _by_title(groups: Mapping[str, Mapping[str, list[str]]]) -> dict[str, list[str]]:
    return {
        f"{group}: {title}": assignments
        for group, entries in groups.items()
        for title, assignments in entries.items()
    }


def _chosen(groups: Mapping[str, Any], titles: Sequence[str]) -> dict[str, dict[str, list[str]]]:
    kept: dict[str, dict[str, list[str]]] = {}
    for group, title in (name.split(": ") for name in titles):
        kept.setdefault(group, {})[title] = groups[group][title]
    return kept
