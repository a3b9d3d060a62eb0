"""The scene of a train that runs the other way: the line mirrored, the train as it is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.line.line_data import numbered, overlaps_of, span_lengths
from catenary.cases.scene.load import scene_from
from catenary.cases.scene.scene import Scene, line_of, resolved, strips_ahead
from catenary.meshgen.line import Line
from catenary.meshgen.wires import SAME_PLACE
from catenary.solver.problem.defects import LengthErrors

FORWARD, BACKWARD = DIRECTIONS = ("forward", "backward")
# Places are rounded to this [m, as decimals], so that a line which is its own mirror image is so
# to the last digit.
_DECIMALS = 9
# Tables that concern neither the line nor its defects and incidents.
_NOT_OF_LINE = ("case", "train", "pantographs", "evaluation", "output", "test")


def turned(scene: Scene) -> Scene:
    """The scene whose train runs the other way. Not collective.

    Trains run towards greater x, so that the line is mirrored instead: x becomes L - x, with the
    length L of the line; heights and lateral positions stay. The order of pantographs stays: the
    first one leads. The run-in keeps its length, unless the train has to begin nearer to the
    evaluated stretch to be in the running range. Heads, wind and curves are symmetric, so that the
    contact force is that of a train in the other direction on the original line. Random errors of
    dropper lengths stay with their droppers. Choices of what to record are dropped.

    Raises
    ------
    InputError
        If no scene describes the mirror image of a part: a mesh file, a free line, overlaps,
        alternating droppers, random heights, an irregular track.
    """
    _refuse_one_sided(scene)
    raw, line = resolved(scene), line_of(scene)
    length = float(line.support_positions[-1])
    for name in ("output", "test"):
        raw.pop(name, None)
    _turn_line(raw["line"], scene, length)
    _turn_irregularities(raw.get("irregularities", {}), line, length)
    for defect in raw.get("defects", []):
        _turn_defect(defect, line, length)
    for incident in raw.get("incidents", []):
        if "dropper" in incident:
            _turn_dropper(incident, line)
    if wind := raw.get("wind"):
        other = 180.0 - wind["direction_deg"]
        wind["direction_deg"] = other if other <= 360.0 else other - 360.0
        wind["stretches"] = _stretches(wind.get("stretches", []), length)
    for motion in ("vertical", "lateral"):
        _turn_course(raw.get("vehicle", {}).get(motion) or {}, length)
    _turn_run(raw, scene, line, length)
    return scene_from(raw, Origin(f"{scene.origin.file}, turned round", recorded=True))


def has_mirrored_line(scene: Scene, other: Scene) -> bool:
    """Whether a scene and the ``other``, which is turned, have the same line, so that trains of
    both directions meet the same. Where it is evaluated is no part of it. Not collective."""
    here, there = (
        {name: table for name, table in resolved(one).items() if name not in _NOT_OF_LINE}
        for one in (scene, other)
    )
    return here == there


def _refuse_one_sided(scene: Scene) -> None:
    line, heights = scene.line, scene.irregularities
    vehicle = scene.vehicle
    parts = {
        "mesh.file": scene.mesh.file is not None,
        "line.wires": line.wires is not None,
        "line.overlap": overlaps_of(line) is not None,
        "line.twin.droppers": line.twin is not None and line.twin.droppers == "alternating",
        "vehicle.irregularity": vehicle is not None and vehicle.irregularity is not None,
        "irregularities.dropper_lengths": heights.dropper_lengths is not None
        and heights.dropper_lengths.standard_deviation_mm > 0
        and line.auxiliary_wire is not None,
    }
    for name in ("contact_wire_height", "running_surface"):
        table = getattr(heights, name)
        random = table is not None and table.standard_deviation_mm is not None
        parts[f"irregularities.{name}.standard_deviation_mm"] = random
    for key, given in parts.items():
        if given:
            raise InputError(
                f"{key} {scene.origin.of(key)} has no mirror image that a scene can say, so that "
                "the train cannot run the other way: run one direction, or take the key away"
            )


def _turn_line(line: dict[str, Any], scene: Scene, length: float) -> None:
    spans, table = span_lengths(scene.line), scene.line
    change = line.get("transition", {})
    first, last = table.transition.n_spans_start, table.transition.n_spans_end
    change["n_spans_start"], change["n_spans_end"] = last, first
    own = spans[first : len(spans) - last] if table.transition.span_m is not None else spans
    line["span_m"] = list(reversed(own)) if len(set(own)) > 1 else [own[0]]
    line.pop("spans_file", None)
    for key in ("stagger_m", "messenger_stagger_m"):
        if line.get(key):
            line[key] = _turned_stagger(line[key], len(spans))
    if curve := line.get("curve"):
        _turn_stretch(curve, length)
    ends = line.get("ends", {})
    ends["start"], ends["end"] = ends.get("end", {}), ends.get("start", {})
    line["fittings"] = [
        {**one, "at_m": _place(length - one["at_m"] - one["length_m"])}
        for one in reversed(line.get("fittings", []))
    ]
    line["tunnels"] = _stretches(line.get("tunnels", []), length)
    line["mid_points_m"] = _mirrored(line.get("mid_points_m", []), length)
    for hung in (line.get("dropper"), (line.get("auxiliary_wire") or {}).get("dropper")):
        if hung is not None:
            _turn_droppers(hung, spans)


def _turned_stagger(given: Sequence[float], n_spans: int) -> list[float]:
    """Lateral positions at the supports from the other end; one number alternates."""
    if len(given) > 1:
        return list(reversed(given))
    return [given[0] if n_spans % 2 == 0 else -given[0]]


def _turn_droppers(hung: dict[str, Any], spans: Sequence[float]) -> None:
    hung.pop("patterns_file", None)
    lengths = sorted(set(spans))
    if hung.get("pre_sag_mm"):
        hung["pre_sag_mm"] = list(reversed(hung["pre_sag_mm"]))
    if positions := hung.pop("positions_m", None):
        if len(lengths) == 1:
            hung["positions_m"] = _mirrored(positions, lengths[0])
            return
        own = {"pre_sag_mm": hung.pop("pre_sag_mm")} if hung.get("pre_sag_mm") else {}
        hung["patterns"] = [
            {"span_m": span, "positions_m": _mirrored(positions, span), **own} for span in lengths
        ]
    elif patterns := hung.get("patterns"):
        by_number = numbered(spans)
        hung["patterns"] = [one for own in patterns for one in _turned_pattern(own, by_number)]


def _turned_pattern(own: dict[str, Any], by_number: Mapping[int, float]) -> list[dict[str, Any]]:
    """A pattern from the other end, one for each length of span that it is for."""
    sag = {"pre_sag_mm": list(reversed(own["pre_sag_mm"]))} if own.get("pre_sag_mm") else {}
    if own.get("span_m") is not None:
        places = _mirrored(own["positions_m"], own["span_m"])
        return [{"span_m": own["span_m"], "positions_m": places, **sag}]
    found: dict[float, list[int]] = {}
    for number in own["spans"]:
        if number in by_number:
            found.setdefault(by_number[number], []).append(len(by_number) + 1 - number)
    return [
        {"spans": sorted(spans), "positions_m": _mirrored(own["positions_m"], length), **sag}
        for length, spans in found.items()
    ]


def _turn_irregularities(tables: dict[str, Any], line: Line, length: float) -> None:
    for name in ("contact_wire_height", "running_surface"):
        if table := tables.get(name):
            _turn_course(table, length)
    if table := tables.get("dropper_lengths"):
        errors: dict[tuple[int, int], float] = {}
        deviation = table.pop("standard_deviation_mm", 0.0)
        if deviation:
            # In the order along the track, as the rest of the line takes them.
            random = LengthErrors(deviation, table["cut_off"], table["seed"])
            of_all = random.of(line.dropper_x.size).tolist()
            errors = dict(zip(_numbers(line), of_all, strict=True))
        for span, dropper, error in table.get("by_dropper", []):
            place = int(span), int(dropper)
            errors[place] = errors.get(place, 0.0) + error
        table.pop("by_dropper_file", None)
        # Along the track, so that lines which are mirror images of each other say so.
        table["by_dropper"] = sorted(
            [*_other_number(line, *place), error] for place, error in errors.items()
        )


def _numbers(line: Line) -> Iterable[tuple[int, int]]:
    """Span and number in it, from 1, of all droppers along the track."""
    for span in range(line.n_spans):
        for dropper in range(line.droppers_of_span(span).size):
            yield span + 1, dropper + 1


def _other_number(line: Line, span: int, dropper: int) -> tuple[int, int]:
    """The numbers of a dropper from the other end: of several at one place each remains that of
    its wires, the first of which comes first from either end."""
    place = line.dropper_of_span(span, dropper)
    before = int((line.droppers_of_span(span - 1) > place.x + SAME_PLACE).sum())
    return line.n_spans + 1 - span, before + place.nth + 1


def _turn_dropper(table: dict[str, Any], line: Line) -> None:
    table["span"], table["dropper"] = _other_number(line, table["span"], table["dropper"])


def _turn_defect(defect: dict[str, Any], line: Line, length: float) -> None:
    if "dropper" in defect:
        _turn_dropper(defect, line)
    if "at_m" in defect:
        defect["at_m"] = _place(length - defect["at_m"])
    _turn_stretch(defect, length)


def _turn_run(raw: dict[str, Any], scene: Scene, line: Line, length: float) -> None:
    train, evaluated = raw["train"], raw["evaluation"]
    begin, end = evaluated["from_m"], evaluated["to_m"]
    _turn_stretch(evaluated, length)
    first, last = line.running_range
    # All strips of all pantographs run within the range.
    ahead = strips_ahead(scene)
    rear = scene.train.pantographs[-1].behind_m + ahead[-1]
    start = evaluated["from_m"] - (begin - train["start_m"])
    train["start_m"] = _place(max(start, length - last + rear))
    stop = evaluated["to_m"] + (train["end_m"] - end)
    train["end_m"] = _place(min(stop, length - first - max(ahead)))


def _stretches(tables: Sequence[dict[str, Any]], length: float) -> list[dict[str, Any]]:
    for table in tables:
        _turn_stretch(table, length)
    return list(reversed(tables))


def _turn_stretch(table: dict[str, Any], length: float) -> None:
    if table.get("from_m") is not None and table.get("to_m") is not None:
        begin, end = table["from_m"], table["to_m"]
        table["from_m"], table["to_m"] = _place(length - end), _place(length - begin)


def _turn_course(table: dict[str, Any], length: float) -> None:
    if pairs := table.get("by_place"):
        table["by_place"] = [[_place(length - x), value] for x, value in reversed(pairs)]
    table.pop("by_place_file", None)


def _mirrored(places: Sequence[float], length: float) -> list[float]:
    return [_place(length - x) for x in reversed(places)]


def _place(x: float) -> float:
    return round(x, _DECIMALS) + 0.0
