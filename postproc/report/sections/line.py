"""The line in motion and at rest: uplift, droppers as they are cut, elasticity, registration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.evaluate.wording import counted, fixed, wire_words
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import EvaluatedRun, Folded, Picture, Section, Text, number
from catenary.postproc.report.study_table import StudyTable, texts_table


class DropperRow(NamedTuple):
    """A dropper for the installer.

    Attributes
    ----------
    nth : number in the file, from 0
    span, number : by which a scene names it, from 1, the latter along the track over all wires
    position, x : from the span's left support and along the track [m]
    length, force : [m], at rest [N]
    wires : names of the wires that it hangs from and carries; none where all droppers join the same
    """

    nth: int
    span: int
    number: int
    position: float
    x: float
    length: float
    force: float
    wires: tuple[str, ...]


def dropper_table(results: Results) -> list[DropperRow]:
    """All droppers of the line in order of x. Not collective."""
    span, x, masts = (results.line(name) for name in ("dropper_span", "dropper_x", "support_x"))
    length, force = results.static("dropper_length"), results.static("dropper_force")
    wires, names = results.dropper_wires(), list(results.roles)
    several = bool((wires != wires[:1]).any())
    order = np.argsort(x, kind="stable")
    first = np.searchsorted(span[order], span)  # of each dropper's span, along the track
    return [
        DropperRow(
            i,
            int(span[i]) + 1,
            along - int(first[i]) + 1,
            float(x[i] - masts[span[i]]),
            float(x[i]),
            float(length[i]),
            float(force[i]),
            tuple(names[wire] for wire in wires[i]) if several else (),
        )
        for along, i in enumerate(order.tolist())
    ]


def droppers_csv(results: Results) -> str:
    """The dropper table as CSV text, lengths to a tenth of a millimetre.

    Beside the force at rest stand the least and the largest one of every step, and for how long the
    dropper was slack; they are empty where they are not known.
    """
    heads = ["span", "dropper", "position in span [m]", "position [m]", "length [m]", "force [N]"]
    heads += ["least force [N]", "largest force [N]", "slack [s]"]
    of_run = *results.extremes("dropper_force"), slack_times(results)
    rows, table = dropper_table(results), []
    for row in rows:
        cut = (fixed(value, 4) for value in (row.position, row.x, row.length))
        known = zip((own[row.nth] for own in of_run), (2, 2, 3), strict=True)
        felt = (fixed(value, digits) if np.isfinite(value) else "" for value, digits in known)
        table.append([row.span, row.number, *cut, fixed(row.force, 2), *felt, *row.wires])
    return csv_text([*heads, *(["hangs from", "carries"] if rows and rows[0].wires else [])], table)


def in_motion(run: EvaluatedRun) -> Section:
    """Uplift and dropper forces."""
    droppers, supports = run.statistics.droppers, run.statistics.supports
    rows: list[list[Any]] = [
        ["largest uplift at a steady arm", number(1e3 * supports.maximum), "mm"]
    ]
    of_droppers: list[list[Any]] = [
        ["droppers that slackened", f"{droppers.n_slackened} of {droppers.evaluated.sum()}", ""],
        ["largest dropper force", number(droppers.maximum), "N"],
        ["smallest dropper force", number(droppers.minimum), "N"],
    ]
    if droppers.x.size:
        rows += of_droppers
    table = texts_table(["in the evaluation stretch", "value", "unit"], rows, {1})
    return Section("Line in motion", [table], _of_motion(run))


def _of_motion(run: EvaluatedRun) -> Iterator[Picture]:
    from catenary.postproc.report.pictures import line_pictures
    from catenary.postproc.report.pictures.line_pictures import channel_pictures

    results, statistics = run.results, run.statistics
    if results.n_rows("time") > 1 and statistics.supports.x.size:
        limit = 1e-3 * run.limit("arm_uplift")
        text = (
            "Uplift of the contact wire at the steady arms: histories, and the largest of each arm."
        )
        yield Picture("uplift", text, lambda: line_pictures.arm_uplift(results, statistics, limit))
    if results.n_rows("time") > 1 and statistics.droppers.x.size:
        text = "Dropper forces: histories of two droppers, and the range of each dropper."
        yield Picture("droppers", text, lambda: line_pictures.dropper_force(results, statistics))
    if any(times.size for times in results.energies().values()):
        text = "Kinetic and elastic energy of the whole line."
        yield Picture("energy", text, lambda: line_pictures.energies(results))
    yield from (Picture(*drawn) for drawn in channel_pictures(results))


def at_rest(run: EvaluatedRun) -> Section:
    """Elasticity, and the droppers as they are cut."""
    from catenary.postproc.report.pictures import line_pictures

    results = run.results
    text = "Height of the contact wire at rest, and its elasticity."
    picture = Picture("static", text, lambda: line_pictures.static_line(results))
    return Section("Line at rest", _of_rest(results), [picture], _all_droppers(results))


def _of_rest(results: Results) -> Iterator[Text | StudyTable]:
    elasticity, span = 1e3 * results.static("elasticity"), results.span_at_rest + 1
    if elasticity.size:
        low, high = elasticity.min(), elasticity.max()
        start, end = results.static("elasticity_x")[[0, -1]]
        lifted = int(np.isfinite(results.static("elasticity_of_wires")).any(axis=0).sum())
        together = ", of all contact wires together" if lifted > 1 else ""
        outside = " and outside of overlaps" if len(results.contact_profiles()) > lifted else ""
        yield Text(
            f"Elasticity in span {span}, {start:.6g} to {end:.6g} m, near the middle of the line"
            f"{outside}{together}: {low:#.3g} to {high:#.3g} mm/N (non-uniformity "
            f"{number(100 * (high - low) / (high + low))} %)."
        )
    own = [row for row in dropper_table(results) if row.span == span]
    if own:
        yield _droppers(own, f"Droppers of span {span}", first=1)


def _all_droppers(results: Results) -> Iterator[Folded]:
    rows = dropper_table(results)
    if not rows:
        return
    title = f"Droppers of all spans ({len(rows)}), also in droppers.csv"
    yield Folded(title, _droppers(rows))


def _droppers(rows: Sequence[DropperRow], title: str = "", first: int = 0) -> StudyTable:
    """A table of droppers from the column ``first`` on."""
    heads = ["span", "dropper", "position in span [m]", "position [m]", "length [m]"]
    heads += ["force at rest [N]", *(["hangs from", "and carries"] if rows[0].wires else [])]
    cells = [
        [row.span, row.number,
         *(number(value, 3) for value in (row.position, row.x, row.length)), number(row.force),
         *map(wire_words, row.wires)][first:]
        for row in rows
    ]  # fmt: skip
    return texts_table(heads[first:], cells, set(range(6 - first)), title)


def has_registration(run: EvaluatedRun) -> bool:
    """Whether steady arms of a run have forces and places across the track."""
    return run.results.registration() is not None


def from_above(run: EvaluatedRun) -> Section:
    """Lateral places of the contact wires, and their steady arms."""
    from catenary.postproc.report.pictures.line_pictures import plan_view

    results = run.results
    heading, pictures = "Steady arms", []
    if results.has_static("contact_y"):
        heading, text = "Line from above", "The line at rest from above, and its steady arms."
        pictures = [Picture("plan_view", text, lambda: plan_view(results))]
    return Section(heading, _lateral(results), pictures, _registration(results))


def _lateral(results: Results) -> Iterator[Text]:
    """Radial forces, and where contact wires that move sideways are at rest in running spans."""
    arms = results.registration()
    assert arms is not None
    if arms.x.size:  # a line of one span has no arms
        low, high = (number(float(end)) for end in (arms.tension.min(), arms.tension.max()))
        n_pushed = np.count_nonzero(arms.pushed)
        yield Text(
            f"The {counted(len(arms.x), 'steady arm')} pull the wires at rest with "
            f"{low if low == high else f'{low} to {high}'} N"
            + (f"; {n_pushed} of them are pushed, with a negative force." if n_pushed else ".")
        )
    if not results.has_static("contact_y"):
        return
    first, last = results.line("running_range")
    for name, wire in results.contact_profiles().items():
        assert wire.y is not None
        own = wire.y[(wire.x >= first) & (wire.x <= last)]
        words = wire_words(name)
        yield Text(
            f"The {words} lies between {own.min():.3f} and {own.max():.3f} m to the left of the "
            "track's axis in the running spans."
        )


def _registration(results: Results) -> Iterator[Folded]:
    found = results.registration()
    assert found is not None
    title = f"Registration: {len(found.x)} steady arms, also in registration.csv"
    yield Folded(title, texts_table(found.heads, found.rows(), set(range(7))))
