"""The worst places of a run as text and tables, each with candidates for its cause."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from catenary.base.errors import CatenaryError
from catenary.cases.run.prepared import rest_of
from catenary.cases.scene.load import recorded_scene
from catenary.cases.studies.questions.causes import Causes
from catenary.cases.studies.questions.worst import Passage, Spot, WorstPlaces, worst_places
from catenary.postproc.read.results import Results
from catenary.postproc.report.study_table import Content, StudyTable, file_table

NONE = "no cause found"
_MOST_CAUSES = 4  # of a place in the text; tables have all


def answer_of(results: Results, count: int) -> tuple[str, dict[str, Content]]:
    """A text about the worst places of a run with candidates for their causes, and tables of all
    places by names of files. Not collective.

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
    if places.passed_to < end:
        lines.append(
            f"The record ends with the last pantograph at {places.passed_to:.0f} m: supports and "
            "droppers beyond are left out."
        )
    named = False
    for (noun, by), found in worst_of_each(places, causes, names, count).items():
        named = named or any(candidates not in ([], [NONE]) for _, candidates in found)
        lines += ["", f"{noun.capitalize()}s by {by}"]
        for sentence, candidates in found:
            more = len(candidates) - _MOST_CAUSES
            lines += [f"  {sentence}", *(f"    {text}" for text in candidates[:_MOST_CAUSES])]
            lines += [f"    and {more} more (-o)"] if more > 0 else []
    everywhere = causes.of_line()
    if everywhere:
        lines += ["", "Of the line as a whole:", *(f"  {text}" for text in everywhere)]
    if unknown:
        lines += ["", f"Elasticity and gusts along the line are not known: {unknown}"]
    if named or everywhere:
        lines += ["", "Candidates are near in place or frequency; none is proved."]
    text = "\n".join(lines)
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
    tables = {"spans": spans, "supports": supports, "droppers": _droppers_table(places, causes)}
    return text, {f"worst_{name}.csv": own for name, own in tables.items()}


def _causes(results: Results, passages: Sequence[Passage]) -> tuple[Causes, str]:
    """Candidates by the scene that a run recorded, and why that gives no line at rest."""
    try:
        scene = recorded_scene(results.attributes["config"], results.path)
        return Causes(results, passages, rest_of(scene)), ""
    except CatenaryError as error:
        return Causes(results, passages, None), str(error)


# What is worst of a kind and by which figure, and what is said of a spot.
_SPOTS: tuple[tuple[tuple[str, str], Callable[[WorstPlaces], Sequence[Spot]], str], ...] = (
    (("support", "uplift"), lambda p: p.arms, "{at}: {v:.1f} mm, median {m:.1f} mm"),
    (("dropper", "largest force"), lambda p: p.forces, "{at}: {v:.0f} N, median {m:.0f} N"),
    (("dropper", "time slack"), lambda p: p.slack, "{at}: {v:.2f} s, median {m:.2f} s"),
)


def worst_of_each(
    places: WorstPlaces, causes: Causes, names: Sequence[str], count: int
) -> dict[tuple[str, str], list[tuple[str, Sequence[str]]]]:
    """Sentences on the worst places of each kind, by what they are and by which figure, each with
    candidates for its cause.

    Parameters
    ----------
    names : of the pantographs
    count : places of a kind, of spans the worst passage of each
    """
    worst: dict[int, Passage] = {}
    for passage in places.passages:
        worst.setdefault(passage.span, passage)
    spans = []
    for one in list(worst.values())[:count]:
        who = f", {names[one.pantograph]}" if len(names) > 1 else ""
        sentence = (
            f"span {one.span + 1}, {one.start:.6g} to {one.end:.6g} m{who}: {one.std:.1f} N, "
            f"median {one.median:.1f} N, force {one.minimum:.0f} to {one.maximum:.0f} N"
        )
        spans.append(_with_candidates(sentence, one.stands_out, causes.of_passage(one)))
    found = {("span", "standard deviation"): spans}
    for kind, spots, words in _SPOTS:
        found[kind] = [
            _with_candidates(
                words.format(at=spot.place, v=spot.value, m=spot.median),
                spot.stands_out,
                causes.at(spot),
            )
            for spot in spots(places)[:count]
        ]
    return {kind: own for kind, own in found.items() if own}


def _with_candidates(
    sentence: str, is_out: bool | None, candidates: list[str]
) -> tuple[str, Sequence[str]]:
    """The sentence with whether the place stands out, None if its likes are too few, and its
    candidates; if one that does has none, that it has none."""
    if is_out is None:
        return f"{sentence}; too few others to compare", candidates
    if not is_out:
        return f"{sentence}; within the scatter of the others", candidates
    return f"{sentence}; stands out", candidates or [NONE]


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
