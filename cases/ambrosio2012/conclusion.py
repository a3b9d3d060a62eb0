"""From the study's runs to verdicts, reasons, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from catenary.cases.ambrosio2012 import figures, ranking, ringing, search, statements
from catenary.cases.ambrosio2012.statements import AVERAGE, DAMPINGS, LIGHT, Force, Run, Runs, Slack
from catenary.cases.ambrosio2012.variations import (
    VARIED,
    run_name,
    searched,
    variations,
)
from catenary.cases.studies.case_study import StudyRun
from catenary.postproc.report.study_report import (
    NOT_REPRODUCED,
    REPRODUCED,
    Finding,
    Reading,
    Study,
    StudyFigure,
    StudyTable,
)

_FORCES = ("mean_N", "std_N", "max_N", "min_N", "loss_percent", "std_0_5_N", "std_5_20_N")


def conclude(runs: Mapping[str, StudyRun], table: Mapping[str, Any]) -> Study:
    """The study of the paper: verdicts under each reading, ranking and search of inputs, figures 8
    to 14.

    Parameters
    ----------
    runs : by name, those that broke included
    table : content of ``study.toml``; what was not run of it is left out
    """
    readings = [one for one in table["readings"] if _was_run(runs, one["name"])]
    judged = {one["name"]: _runs_of(runs, table, one["name"]) for one in readings}
    varied = {
        title: {damping: _of(runs.get(run_name(VARIED, damping, title))) for damping in DAMPINGS}
        for title in variations(table)
        if run_name(VARIED, LIGHT, title) in runs
    }
    found = {name: statements.judge(own) for name, own in judged.items()}
    first, *others = readings
    base = {damping: judged[first["name"]][damping].get("single") for damping in DAMPINGS}
    ranked = ranking.rank(base, varied)
    explained = [
        _explained(one, judged[first["name"]], {r["title"]: found[r["name"]] for r in others},
                   ranked)
        for one in found[first["name"]]
    ]  # fmt: skip
    return Study(
        title="Two pantographs on the generic catenary of Ambrosio et al. (2012)",
        lead="The paper's statements about its results, judged by runs of its line at 300 km/h. "
        "Statistics of the 20 Hz force from 400 to 800 m; 'light' and 'average' are the dampings "
        "alpha = 0.00275 s and 0.0275 s.",
        readings=[
            Reading(one["name"], one["title"], changes_of(one),
                    explained if one is first else found[one["name"]])
            for one in readings
        ],  # fmt: skip
        tables=[
            _side_by_side([one for one in readings if one.get("figures")], found),
            _searched(runs, table),
            *(_table_of(one, judged[one["name"]]) for one in readings),
            ringing.table(_bands(runs, readings, judged)),
            ranking.table(ranked),
        ],
        figures=_drawn(runs, table, readings, judged),
    )  # fmt: skip


def _drawn(
    runs: Mapping[str, StudyRun],
    table: Mapping[str, Any],
    readings: Sequence[Mapping[str, Any]],
    judged: Mapping[str, Runs],
) -> list[StudyFigure]:
    """The paper's figures of all readings that are to be shown, beside each other."""
    drawn = []
    for number, reading in enumerate(one for one in readings if one.get("figures")):
        folders = {
            damping: {
                train["name"]: runs[run_name(reading["name"], damping, train["name"])].folder
                for train in table["trains"]
                if _done(runs.get(run_name(reading["name"], damping, train["name"])))
            }
            for damping in DAMPINGS
        }
        own = figures.draw(folders, judged[reading["name"]])
        if number:
            own = [
                replace(
                    one,
                    name=f"{one.name}_{reading['name']}",
                    caption=f"{one.caption[:-1]}: {reading['title']}.",
                )
                for one in own
            ]
        drawn += own
    return sorted(drawn, key=lambda one: one.name[: len("figure_00")])


def _side_by_side(
    readings: Sequence[Mapping[str, Any]], found: Mapping[str, Sequence[Finding]]
) -> StudyTable:
    """All statements under the readings that the figures show, each with its figures."""
    columns = [found[one["name"]] for one in readings]
    met = [sum(one.verdict == REPRODUCED for one in column) for column in columns]
    return StudyTable(
        "The nine statements beside each other",
        "; ".join(
            f"{reading['title']}: {n} of {len(column)} reproduced"
            for reading, n, column in zip(readings, met, columns, strict=True)
        )
        + ".",
        ["", "statement", *(reading["title"] for reading in readings)],
        [
            [str(row[0].number), row[0].statement, *(f"{one.verdict}: {one.found}" for one in row)]
            for row in zip(*columns, strict=True)
        ],
    )


def _searched(runs: Mapping[str, StudyRun], table: Mapping[str, Any]) -> StudyTable:
    """The readings of the search and the one that it is around, the best first."""
    around = [one for one in table["readings"] if one["name"] == table["search"]["around"]]
    names = {one["title"]: one["name"] for one in around}
    names |= {title: one["name"] for title, one in searched(table).items()}
    judged = [
        search.judge(title, _runs_of(runs, table, name))
        for title, name in names.items()
        if _was_run(runs, name)
    ]
    return search.table(search.rank(judged))


def _bands(
    runs: Mapping[str, StudyRun],
    readings: Sequence[Mapping[str, Any]],
    judged: Mapping[str, Runs],
) -> dict[str, tuple[ringing.Band, Runs]]:
    """The first modes of each reading's line beside its runs; without readings that broke."""
    return {
        one["title"]: (
            ringing.band_of(runs[run_name(one["name"], LIGHT, "single")].scene),
            judged[one["name"]],
        )
        for one in readings
        if judged[one["name"]][LIGHT].get("single") is not None
    }


def _was_run(runs: Mapping[str, StudyRun], reading: str) -> bool:
    return run_name(reading, LIGHT, "single") in runs


def _done(run: StudyRun | None) -> bool:
    return run is not None and run.ended.done


def _runs_of(runs: Mapping[str, StudyRun], table: Mapping[str, Any], reading: str) -> Runs:
    return {
        damping: {
            train["name"]: _of(
                runs[run_name(reading, damping, train["name"])],
                train.get("separation_m"),
                train.get("named_in_text", "separation_m" not in train),
            )
            for train in table["trains"]
            if run_name(reading, damping, train["name"]) in runs
        }
        for damping in DAMPINGS
    }


def _of(run: StudyRun | None, separation: float | None = None, named: bool = True) -> Run | None:
    """The figures of a run that the statements need; None if it broke or lacks statistics."""
    if run is None or not run.ended.done:
        return None
    summary, measured = run.ended.summary, run.ended.measured
    forces = [[one[key] for key in _FORCES] for one in summary["pantographs"]]
    uplift = summary["supports"]["max_uplift_mm"]
    if any(value is None for values in forces for value in values) or uplift is None:
        return None
    slack = measured["slack"]["mid"]
    return Run(
        separation=separation,
        named=named,
        forces=[Force(*values) for values in forces],
        uplift=1e-3 * uplift,
        onset=measured["onset_m"],
        slack=Slack(slack["leading"], slack["trailing"], slack["of"]),
        wave_speed=measured["wave_speed_m_per_s"],
        train_speed=measured["train_speed_m_per_s"],
    )


def _explained(
    finding: Finding,
    runs: Runs,
    others: Mapping[str, Sequence[Finding]],
    ranked: Sequence[ranking.Row],
) -> Finding:
    """The finding with the reason that the runs give where it differs from the paper."""
    if finding.verdict != NOT_REPRODUCED:
        return finding
    parts = []
    text = statements.judge(statements.named_only(runs))[finding.number - 1]
    if text.found != finding.found:
        parts.append(f"With only the separations that the text names: {text.verdict} "
                     f"({text.found}).")  # fmt: skip
    reproduced = {
        title: findings[finding.number - 1].found
        for title, findings in others.items()
        if findings[finding.number - 1].verdict == REPRODUCED
    }
    parts += [f"Reproduced with {title}: {found}." for title, found in reproduced.items()]
    if others and not reproduced:
        parts.append(f"None of the {len(others)} other readings reproduces it.")
    moved = ranking.movers(finding.number, ranked)
    if moved:
        parts.append(moved)
    return replace(finding, reason=" ".join(parts))


def changes_of(reading: Mapping[str, Any]) -> list[str]:
    """What a reading changes of the case, its kind of pantograph included, as assignments."""
    kind = [f"train.pantographs.0.name={reading['kind']}"] if "kind" in reading else []
    return [*kind, *reading["set"]]


def _table_of(reading: Mapping[str, Any], runs: Runs) -> StudyTable:
    head = ["train", "damping", "pantograph", "mean [N]", "std [N]", "std / mean [%]", "max [N]",
            "min [N]", "loss [%]", "arm uplift [mm]", "slack at mid-span"]  # fmt: skip
    rows = []
    for damping in (LIGHT, AVERAGE):
        for train, run in runs[damping].items():
            if run is None:
                rows.append([train, damping, "broke", *[""] * (len(head) - 3)])
                continue
            slack = run.slack
            names = ("leading", "trailing") if len(run.forces) > 1 else ("single",)
            for name, force in zip(names, run.forces, strict=True):
                rows.append([
                    train, damping, name, f"{force.mean:.1f}", f"{force.std:.1f}",
                    f"{100 * force.std / force.mean:.0f}", f"{force.maximum:.0f}",
                    f"{force.minimum:.0f}", f"{force.loss_percent:.1f}", f"{1e3 * run.uplift:.1f}",
                    f"{slack.trailing if name == 'trailing' else slack.leading} of {slack.of}",
                ])  # fmt: skip
    changes = " ".join(changes_of(reading))
    return StudyTable(
        f"All configurations: {reading['title']}",
        f"Changes: {changes}." if changes else "No changes.",
        head,
        rows,
    )
