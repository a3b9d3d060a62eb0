"""Where the cuts of a line lie: masts and droppers with the heights of both wires. No mesh yet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.meshgen.line import Line
from catenary.solver.base.errors import InputError

# Two cuts of a wire closer than this are taken for a slip of the pen [m].
SHORTEST_GAP = 1e-3

# Only for the first guess of the messenger wire's sag; equilibrium uses the scene's value [m/s2].
_GRAVITY = 9.81


@dataclass(frozen=True)
class Stations:
    """Every place at which both wires are cut, in order of x; n = masts + droppers.

    Attributes
    ----------
    is_mast : (n,) bool, masts (both anchors included); the others are droppers
    contact_wire : (n, 3) points of the contact wire before form finding [m]
    messenger_wire : (n, 3) points of the messenger wire, its sag estimated [m]
    """

    is_mast: np.ndarray
    contact_wire: np.ndarray
    messenger_wire: np.ndarray


def find_stations(line: Line) -> Stations:
    """Masts and droppers of a line with both wires' points there. Not collective.

    Raises
    ------
    InputError
        If lists do not fit the number of spans, a dropper is not inside its span, droppers are
        not in order, or the messenger wire does not pass above a dropper's lower end.
    """
    _check_lists(line)
    masts = line.support_positions
    x, is_mast = [masts[:1]], [True]
    pre_sag, sag = [0.0], [0.0]
    for span, (length, places, lowered) in enumerate(
        zip(line.span_lengths, line.dropper_positions, line.pre_sag, strict=True)
    ):
        _check_span(span, length, places)
        along = np.append(np.asarray(places, dtype=float), length)
        # The mast is taken from the line, not from start + length, so that positions agree.
        x.append(np.append(masts[span] + along[:-1], masts[span + 1]))
        is_mast += [False] * len(places) + [True]
        pre_sag += [*lowered, 0.0]
        sag += list(_messenger_sag(line, length, along))
    stations = _place_wires(line, np.concatenate(x), np.array(pre_sag), np.array(sag), is_mast)
    _check_heights(line, stations)
    return stations


def _messenger_sag(line: Line, length: float, along: np.ndarray) -> np.ndarray:
    """How far the messenger wire hangs below its supports, a parabola of q L^2 / 8F at midspan.

    It carries its own weight and the contact wire's, spread evenly.
    """
    load = (line.messenger_wire.mass_per_length + line.contact_wire.mass_per_length) * _GRAVITY
    return np.asarray(load * along * (length - along) / (2.0 * line.messenger_wire.tension))


def _place_wires(
    line: Line, x: np.ndarray, pre_sag: np.ndarray, sag: np.ndarray, is_mast: list[bool]
) -> Stations:
    stagger = np.interp(x, line.support_positions, line.stagger)
    top = line.contact_height + line.encumbrance
    return Stations(
        np.array(is_mast),
        np.column_stack([x, stagger, line.target_height(x) - pre_sag]),
        np.column_stack([x, np.zeros_like(x), top - sag]),
    )


def _check_lists(line: Line) -> None:
    if line.n_spans == 0:
        raise InputError("the line has no span: span_lengths must name at least one length")
    for name, values, wanted in (
        ("dropper_positions", line.dropper_positions, line.n_spans),
        ("pre_sag", line.pre_sag, line.n_spans),
        ("stagger", line.stagger, line.n_spans + 1),
    ):
        if len(values) != wanted:
            raise InputError(
                f"{name} has {len(values)} entries, but {line.n_spans} spans need {wanted}"
            )
    for span, (places, lowered) in enumerate(
        zip(line.dropper_positions, line.pre_sag, strict=True), start=1
    ):
        if len(places) != len(lowered):
            raise InputError(
                f"span {span} has {len(places)} droppers, but pre_sag names {len(lowered)} values"
            )


def _check_span(span: int, length: float, places: tuple[float, ...]) -> None:
    if not length > SHORTEST_GAP:
        raise InputError(f"the length of span {span + 1} is {length:g} m, but must be positive")
    for place in places:
        if not SHORTEST_GAP <= place <= length - SHORTEST_GAP:
            where = (
                "on a mast" if min(abs(place), abs(place - length)) < SHORTEST_GAP else "outside"
            )
            raise InputError(
                f"the dropper at {place:g} m of span {span + 1} lies {where}, but must lie "
                f"between the masts, which stand at 0 and {length:g} m"
            )
    for left, right in zip(places[:-1], places[1:], strict=True):
        if right - left < SHORTEST_GAP:
            raise InputError(
                f"the droppers at {left:.10g} and {right:.10g} m of span {span + 1} are not in "
                f"ascending order at least {SHORTEST_GAP:g} m apart"
            )


def _check_heights(line: Line, stations: Stations) -> None:
    length = stations.messenger_wire[:, 2] - stations.contact_wire[:, 2]
    short = np.flatnonzero(~stations.is_mast & ~(length > 0.0))
    if short.size:
        x = stations.contact_wire[short[0], 0]
        span = int(np.searchsorted(line.support_positions, x))
        at = x - line.support_positions[span - 1]
        raise InputError(
            f"at the dropper at {at:g} m of span {span} the messenger wire is expected to hang "
            f"{-length[short[0]]:.3f} m below the contact wire: raise the encumbrance "
            f"({line.encumbrance:g} m), raise the messenger wire's tension or lower the rise of "
            "the transition spans"
        )
