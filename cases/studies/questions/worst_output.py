"""The worst places of a run as text and tables, each with candidates for its cause."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from catenary.base.errors import CatenaryError
from catenary.cases.run.prepared import rest_of
from catenary.cases.scene.load import recorded_scene
from catenary.cases.studies.questions.causes import Causes
from catenary.cases.studies.questions.worst import Passage, Spot, WorstPlaces, worst_places
from catenary.postproc.read.results import Results
from catenary.postproc.report.study_table import StudyTable, file_table, write_files

NONE = "no cause found"
_MOST_CAUSES = 4  # of a place in the text; tables have all


class Answer(NamedTuple):
    """The tables of spans, supports and droppers, whole, and a text about the worst of each."""

    spans: StudyTable
    supports: StudyTable
    droppers: StudyTable
    text: str


def answer_of(results: Results, count: int) -> Answer:
    """Find the worst places of a run and candidates for their causes. Not collective.

    Parameters
    ----------
    count : places of each kind in the text
    """
    places = worst_places(results)
    causes, unknown = _causes(results, places.passages)
    names = results.pantograph_names()
    start, end = results.evaluation
    lines = [
        f"{results.attributes['case']} at {3.6 * results.fact('speed'):.0f} km/h, evaluated from "
        f"{start:.0f} to {end:.0f} m",
        *results.damage,
    ]
    if not places.passages:
        lines.append("No span lies whole within the evaluated stretch and the record.")
    lines += _of_spans(places.passages, causes, names, count)
    for title, spots, words in (
        ("Supports by uplift", places.arms, "{at}: {v:.1f} mm, median {m:.1f} mm"),
        ("Droppers by largest force", places.forces, "{at}: {v:.0f} N, median {m:.0f} N"),
        ("Droppers by time slack", places.slack, "{at}: {v:.2f} s, median {m:.2f} s"),
    ):
        lines += _of_spots(title, spots[:count], words, causes)
    everywhere = causes.of_line()
    if everywhere:
        lines += ["", "Of the line as a whole:", *(f"  {text}" for text in everywhere)]
    if unknown:
        lines += ["", f"Elasticity and gusts along the line are not known: {unknown}"]
    text = "\n".join([*lines, "", "Candidates are near in place or frequency; none is proved."])
    of_span = ("std_N", "max_N", "min_N", "loss_percent", "median_std_N", "stands_out")
    spans = file_table(
        ("span", "from_m", "to_m", "pantograph", *of_span, "causes"),
        (
            (p.span + 1, p.start, p.end, names[p.pantograph], *p[4:], causes.of_passage(p))
            for p in places.passages
        ),
    )
    supports = file_table(
        ("x_m", "wire", "max_uplift_mm", "median_mm", "stands_out", "causes"),
        ((*arm[1:], causes.at(arm)) for arm in places.arms),
    )
    return Answer(spans, supports, _droppers_table(places, causes), text)


def _causes(results: Results, passages: Sequence[Passage]) -> tuple[Causes, str]:
    """Candidates by the scene that a run recorded, and why that gives no line at rest."""
    try:
        scene = recorded_scene(results.attributes["config"], results.path)
        return Causes(results, passages, rest_of(scene)), ""
    except CatenaryError as error:
        return Causes(results, passages, None), str(error)


def _of_spans(
    passages: Sequence[Passage], causes: Causes, names: Sequence[str], count: int
) -> list[str]:
    """The worst passage of each of the worst spans."""
    lines = ["", "Spans by standard deviation"] if passages else []
    worst: dict[int, Passage] = {}
    for one in passages:
        worst.setdefault(one.span, one)
    for one in list(worst.values())[:count]:
        who = f", {names[one.pantograph]}" if len(names) > 1 else ""
        lines.append(
            f"  span {one.span + 1}, {one.start:.0f} to {one.end:.0f} m{who}: {one.std:.1f} N, "
            f"median {one.median:.1f} N, force {one.minimum:.0f} to {one.maximum:.0f} N"
            f"{scatter_words(one.stands_out)}"
        )
        lines += _cause_lines(causes.of_passage(one), one.stands_out)
    return lines


def _of_spots(title: str, spots: Sequence[Spot], words: str, causes: Causes) -> list[str]:
    lines = ["", title] if spots else []
    for one in spots:
        sentence = words.format(at=one.place, v=one.value, m=one.median)
        lines.append(f"  {sentence}{scatter_words(one.stands_out)}")
        lines += _cause_lines(causes.at(one), one.stands_out)
    return lines


def candidates(causes_found: Sequence[str], is_out: bool | None) -> Sequence[str]:
    """Candidate causes of a place. Where ``causes_found`` is empty and the place stands out from
    its likes, ``is_out``, a sentence that there is none."""
    return causes_found or ([NONE] if is_out else [])


def _cause_lines(causes_found: Sequence[str], is_out: bool | None) -> list[str]:
    """Lines for the candidates of a place."""
    lines = [f"    {text}" for text in candidates(causes_found, is_out)[:_MOST_CAUSES]]
    more = len(causes_found) - _MOST_CAUSES
    return [*lines, f"    and {more} more (-o)"] if more > 0 else lines


def scatter_words(is_out: bool | None) -> str:
    """Whether a figure stands out among its likes, None if they are too few, in words."""
    if is_out is None:
        return "; too few others to compare"
    return "; stands out" if is_out else "; within the scatter of the others"


def _droppers_table(places: WorstPlaces, causes: Causes) -> StudyTable:
    slack = {one.number: one for one in places.slack}
    cells = []
    for one in places.forces:
        times, least = slack.get(one.number), float(places.least[one.number])
        stands_out = (times is not None and times.stands_out) or one.stands_out
        slack_s = 0.0 if times is None else times.value
        values = one.value, one.median, least, slack_s, stands_out
        cells.append((one.x, one.wire, *values, causes.at(one)))
    heads = ("x_m", "wire", "max_N", "usual_max_N", "min_N", "slack_s", "stands_out", "causes")
    return file_table(heads, cells)


def write(folder: Path, answer: Answer) -> list[Path]:
    """Write the three tables; returns the files. Not collective."""
    tables = {"spans": answer.spans, "supports": answer.supports, "droppers": answer.droppers}
    return write_files(folder, {f"worst_{name}.csv": own for name, own in tables.items()})
