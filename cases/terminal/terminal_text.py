"""Text of the verbs for the terminal: tables and sentences, and a bar of runs; no decision."""

from __future__ import annotations

import logging
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from catenary.meshgen.line import Line
from catenary.meshgen.wires import Role, Wire
from catenary.postproc.evaluate.wording import (
    UNCOMPARED,
    UNCOMPARED_SAYS,
    VERDICTS,
    counted,
    decimals_that_tell,
    fixed,
)
from catenary.postproc.read.registration import Registration

# A run shows its own progress if this logger takes messages; several at once share a bar.
_logger = logging.getLogger("catenary.progress")


def summary_text(
    summary: Mapping[str, Any],
    folder: Path,
    phase_wall: Mapping[str, float] | None = None,
    waited: float | None = None,
) -> str:
    """The most important figures of a finished run.

    Parameters
    ----------
    summary : content of ``summary.json``
    folder : where the results are
    phase_wall : wall time of the phases, that of the report included, None if not known [s]
    waited : wall time since the command was given, None if not known [s]
    """
    start, end = summary["evaluation_m"]
    lines = [
        f"{summary['case']} at {summary['speed_km_h']:g} km/h, evaluated from {start:g} to "
        f"{end:g} m",
        "",
        f"  {'pantograph':12}{'mean':>8}{'std':>8}{'max':>8}{'min':>8}{'stat max':>10}"
        f"{'stat min':>10}  [N]{'loss':>5} [%]",
    ]
    for i, one in enumerate(summary["pantographs"]):
        figures = [one[f"{name}_N"] for name in ("mean", "std", "max", "min")]
        limits = [one["stat_max_N"], one["stat_min_N"]]
        lines.append(
            f"  {one.get('name') or i + 1!s:12}"
            + "".join(f"{_number(value):>8}" for value in figures)
            + "".join(f"{_number(value):>10}" for value in limits)
            + f"{_number(one['loss_percent'], 3):>10}"
        )
    droppers = summary["droppers"]
    lines += [
        "",
        f"  largest uplift at a steady arm {_number(summary['supports']['max_uplift_mm'])} mm; "
        f"{counted(droppers['n_slackened'], 'dropper')} slackened",
        f"  {counted(summary['n_steps'], 'step')}, {counted(summary['n_dofs'], 'unknown')}, "
        f"{counted(summary['n_ranks'], 'rank')}, "
        f"real-time factor {_number(summary['real_time_factor'], 2)}, with all records "
        f"{_number(summary.get('real_time_factor_with_records'), 2)}",
        *_waited(phase_wall or {}, waited),
        *([f"  {summary['detour']}"] if summary.get("detour") else []),
        *([f"  {summary['window']}"] if summary.get("window") else []),
        *_sizes_of_steps(summary.get("inner_iterations", {})),
        "",
    ]
    lines += _acceptance(summary)
    remarks = [*summary.get("complaints", []), *summary.get("remarks", [])]
    lines += ["", *(f"  REMARK      {text}" for text in remarks)]
    lines += [""] * bool(remarks) + [f"Results: {folder}"]
    return "\n".join(lines)


def _acceptance(summary: Mapping[str, Any]) -> list[str]:
    """All criteria, those that are not judged with the reason, and by which rule books."""
    judged, left = summary["acceptance"], summary.get("not_judged", [])
    several = len({row.get("book") for row in [*judged, *left]}) > 1
    lines = []
    for row in judged:
        value, limit = row["value"], row["limit"]
        digits = decimals_that_tell(value, limit, 2)
        # At a limit that has to be kept clear of, the relation alone tells why.
        only = f"{row['relation']} " if row["passed"] is False and value == limit else ""
        lines.append(
            f"  {VERDICTS[row['passed']]:10}  {labelled(row, several)}: {_number(value, digits)}, "
            f"limit {only}{_number(limit, digits)} {row.get('unit', '')}".rstrip()
            + ("" if row.get("compared", True) else f" {UNCOMPARED}")
        )
    lines += [
        f"  {VERDICTS[None]:10}  {labelled(row, several)}, because {row['because']}" for row in left
    ]
    if summary.get("judged_by"):
        whole = {True: "PASSED", False: "NOT PASSED", None: "NOT JUDGED"}[summary.get("passed")]
        lines.append(f"  {whole} by {summary['judged_by']}")
    if not all(row.get("compared", True) for row in judged):
        lines.append(f"  {UNCOMPARED_SAYS}")
    return lines


def labelled(row: Mapping[str, Any], several: bool) -> str:
    """The name of a criterion in ``summary.json``, with its rule book where there are several."""
    return f"{row['criterion']} ({row['book']})" if several else str(row["criterion"])


def _waited(phase_wall: Mapping[str, float], waited: float | None) -> list[str]:
    """Line on the time of the whole command and of the run's phases; none without ``waited``."""
    if waited is None:
        return []
    parts = ", ".join(f"{name} {wall:.1f}" for name, wall in phase_wall.items())
    return [f"  {waited:.1f} s from the command to this summary: {parts}"]


def _sizes_of_steps(counted: Mapping[str, Any]) -> list[str]:
    """Numbers of steps of each size, where steps adapt."""
    if "rejected_steps" not in counted:
        return []
    sizes = [
        f"{count} of {name.removeprefix('steps_of_').replace('_', ' ')}"
        for name, count in counted.items()
        if name.startswith("steps_of_") and count
    ]
    again = counted["rejected_steps"] + counted["failed_steps"]
    return [
        f"  adaptive steps: {', '.join(sizes)}; {again} repeated, "
        f"{counted['failed_steps']} of them without a solution"
    ]


def _number(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else fixed(value, digits)


def static_text(table: Mapping[str, Any], line: Line, half_head: float | None = None) -> str:
    """Dropper table, registration, sag and elasticity of a line at rest.

    Parameters
    ----------
    table : arrays in SI units named as in ``/static`` and ``/line`` of a result file:
        ``dropper_span``, ``dropper_x``, ``dropper_length``, ``dropper_force``, ``contact_x``,
        ``contact_height``, ``elasticity_x``, ``elasticity``, ``wires/NAME``, and what
        `cases.run.at_rest.static_table` adds
    line : for supports and contact wires
    half_head : half of the length of the shortest strip, None if no scene says it [m]
    """
    data = {name: np.asarray(value) for name, value in table.items()}
    lines = [
        *_dropper_table(data, line),
        "",
        *(_wire_text(wire, data.get(f"lengths/{wire.name}")) for wire in line.wires),
        *_contact_wires_text(data, line, half_head),
    ]
    lines += _registration_text(data, [wire.name for wire in line.wires])
    lines.append(elasticity_text(data["elasticity_x"], data["elasticity"]))
    return "\n".join(lines)


def elasticity_text(x: np.ndarray, elasticity: np.ndarray) -> str:
    """Sentence on elasticities (n,) [m/N] at places (n,) along the track [m]."""
    lift = 1e3 * elasticity
    return (
        f"Elasticity from {x.min():g} to {x.max():g} m: {lift.min():.3f} to "
        f"{lift.max():.3f} mm/N, mean {lift.mean():.3f} mm/N, non-uniformity "
        f"{100 * (lift.max() - lift.min()) / (lift.max() + lift.min()):.1f} %"
    )


def _dropper_table(data: Mapping[str, np.ndarray], line: Line) -> list[str]:
    """Lines of the table of droppers, span by span."""
    masts = line.support_positions
    several = len(line.droppers) > 1
    hung = [
        f"  {upper} to {lower}" if several else ""
        for upper, lower in zip(data["dropper_upper"], data["dropper_lower"], strict=True)
    ]
    head = f"{'span':>5} {'in span [m]':>12} {'length [m]':>11} {'force [N]':>10}"
    lines = [head + ("  hangs from and to" if several else "")]
    spans = data["dropper_span"].astype(int)
    shown: dict[tuple[float | str, ...], int] = {}
    for span in np.unique(spans):
        chosen = spans == span
        x = data["dropper_x"][chosen] - masts[span]
        length, force = data["dropper_length"][chosen], data["dropper_force"][chosen]
        # Millimetres and newtons decide: a span that is cut like an earlier one is only named.
        names = [hung[i] for i in np.flatnonzero(chosen)]
        rounded = np.round(np.concatenate([x, 1e3 * length, force])).tolist()
        pattern = (*rounded, *names)
        if pattern in shown:
            lines.append(f"{span + 1:5d} as span {shown[pattern]}")
            continue
        shown[pattern] = int(span) + 1
        lines += [
            f"{span + 1:5d} {x[i]:12.3f} {length[i]:11.4f} {fixed(force[i], 1):>10}{names[i]}"
            for i in range(x.size)
        ]
    return lines


def _contact_wires_text(
    data: Mapping[str, np.ndarray], line: Line, half_head: float | None
) -> list[str]:
    """Sentences on height, sag and stagger of the contact wires where trains run on them."""
    lines: list[str] = []
    first, last = line.running_range
    contact = line.wires_of(Role.CONTACT)
    wires = [one.name for one in contact]
    ends = np.cumsum([data[f"wires/{name}"].size for name in wires])[:-1]
    chains_x, heights = (np.split(data[f"contact_{own}"], ends) for own in ("x", "height"))
    for own, at, height in zip(contact, chains_x, heights, strict=True):
        name = "Contact wire" if len(wires) == 1 else own.name
        lines += _sag_text(name, line.support_positions, line.running_spans(own), at, height)
    if "contact_y" in data:
        for name, at, y in zip(wires, chains_x, np.split(data["contact_y"], ends), strict=True):
            there = y[(at >= first) & (at <= last)]
            wire = "Contact wire" if len(wires) == 1 else name
            low, high = fixed(there.min(), 4), fixed(there.max(), 4)
            text = f"{wire} at rest: {low} to {high} m to the left"
            if half_head is not None:
                within = "within" if np.abs(there).max() <= half_head else "BEYOND"
                text += f", {within} the {half_head:g} m of the shortest strip to either side"
            lines.append(text)
    return lines


def _sag_text(
    wire: str, masts: np.ndarray, spans: Sequence[int], x: np.ndarray, height: np.ndarray
) -> list[str]:
    """Sentence on heights (n,) [m] of a wire at places (n,) [m] and on its sag below the straight
    line between two supports at ``masts``; none without ``spans``, which count from 0."""
    at_supports, within, sags = [], [], []
    for span in spans:
        ends = masts[span : span + 2]
        held = np.interp(ends, x, height)
        inside = (x >= ends[0]) & (x <= ends[1])
        at_supports += held.tolist()
        within += height[inside].tolist()
        sags.append(float((np.interp(x[inside], ends, held) - height[inside]).max()))
    if not spans:
        return []
    most = int(np.argmax(np.round(sags, 5)))
    return [
        f"{wire} at rest in {_span_words(spans)}: {_from_to(within)} m above the rail, "
        f"{_from_to(at_supports)} m at the supports; largest sag between two supports "
        f"{1e3 * sags[most]:.1f} mm, in span {spans[most] + 1}"
    ]


def _from_to(heights: Sequence[float]) -> str:
    """Smallest and largest of heights [m], or the one that both are to a tenth of a millimetre."""
    low, high = f"{min(heights):.4f}", f"{max(heights):.4f}"
    return low if low == high else f"{low} to {high}"


def _span_words(spans: Sequence[int]) -> str:
    """Words on spans, counted from 0, by stretches."""
    breaks = np.flatnonzero(np.diff(spans) > 1) + 1
    parts = [(own[0] + 1, own[-1] + 1) for own in np.split(np.asarray(spans), breaks)]
    texts = [f"{first}" if first == last else f"{first} to {last}" for first, last in parts]
    return ("spans " if len(spans) > 1 else "span ") + ", ".join(texts)


def _registration_text(data: Mapping[str, np.ndarray], wires: Sequence[str]) -> list[str]:
    """Steady arms at rest, those that are alike once; none of a straight wire."""
    table = Registration.of(data, wires)
    if table is None:
        return []
    head = ("arm at [m]", "stagger [m]", "radial [N]", "lift [N]", "slope [deg]", "along [N]")
    heads = (*head, "slew [deg]")
    widths = [max(len(name) + 1, 10) for name in heads]

    def row(cells: Sequence[str]) -> str:
        return "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))

    lines = ["", row(heads) + ("  wire" if table.wires else "")]
    shown: dict[tuple[str, ...], str] = {}
    for place, *figures in table.rows():
        wire = f"  {figures[-1]}" if table.wires else ""
        if tuple(figures) in shown:
            lines.append(f"{place:>{widths[0]}} as {shown[tuple(figures)]}{wire}")
            continue
        shown[tuple(figures)] = place
        columns = figures[:-1] if table.wires else figures
        lines.append(row((place, *columns)) + wire)
    return [*lines, *(f"  {text}" for text in table.warnings()), ""]


def _wire_text(wire: Wire, lengths: np.ndarray | None) -> str:
    """Tension of a wire, and what is special about its pieces; ``lengths`` of clamped ones [m]."""
    text = f"{wire.name}: tension {wire.tension:g} N"
    shares = sorted({part.tension for part in wire.taken})
    if shares:
        left = " or ".join(f"{wire.tension - less:g}" for less in shares)
        text += f", {left} N beside wires that are clamped to it"
    if lengths is not None and lengths.size:
        low, high = f"{lengths.min():.3f}", f"{lengths.max():.3f}"
        between = low if low == high else f"{low} to {high}"
        text += f"; {counted(lengths.size, 'piece')}, {between} m long from clamp to clamp"
    return text


class RunsBar:
    """Shows how many runs have ended and how long the others will take, if somebody looks on.

    A context manager. Not collective.

    Parameters
    ----------
    n_runs : how many there are; 0 shows nothing
    say : writes a line
    stream : where to, standard error if not given
    what : what is counted
    """

    def __init__(
        self,
        n_runs: int,
        say: Callable[[str], None],
        stream: TextIO | None = None,
        what: str = "runs",
    ) -> None:
        stream = sys.stderr if stream is None else stream
        self._say = say
        self._bar: Any = None
        if n_runs and stream.isatty() and _logger.isEnabledFor(logging.INFO):
            from tqdm import tqdm  # not loaded where nobody looks on

            self._bar = tqdm(
                total=n_runs,
                file=stream,
                leave=False,
                ncols=min(shutil.get_terminal_size().columns, 100),
                bar_format=what + " {percentage:3.0f}% |{bar}| {n} of {total}, left {remaining}",
            )

    def say(self, line: str) -> None:
        """Write a line above the bar."""
        if self._bar is not None:
            self._bar.clear()
        self._say(line)
        if self._bar is not None:
            self._bar.refresh()

    def ended(self, n_runs: int = 1) -> None:
        """Count further runs, one if no number is given."""
        if self._bar is not None:
            self._bar.update(n_runs)

    def __enter__(self) -> RunsBar:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self._bar is not None:
            self._bar.close()
