"""Elasticity of contact wires under static forces."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError
from catenary.meshgen.line import Line
from catenary.meshgen.wires import SAME_PLACE, Role
from catenary.solver.effects.build_model import with_wires_apart
from catenary.solver.model.link_directions import at_places
from catenary.solver.model.matrices import OperatorBands
from catenary.solver.model.model import Model

# Length of line to both sides of a stretch in the first solution [m], and motion that is none.
_FIRST_REACH, _STILL = 1500.0, 1e-13
# Longest part of a stretch, whose places are solved for one by one in all of it [m].
_LONGEST = 300.0
# Numbers of solutions that are held at once.
_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class Elasticity:
    """Elasticity of contact wires at places along the track.

    Attributes
    ----------
    x : (n,) places, ascending [m]
    compliance : (n, w, w) lift of a contact wire there under a unit force on another one, in the
        order of the line's contact wires; NaN where one of the two is not [m/N]
    """

    x: np.ndarray
    compliance: np.ndarray

    @property
    def of_wires(self) -> np.ndarray:
        """Lift of each contact wire under a unit force on it alone, (n, w), NaN where it is not
        [m/N]."""
        return np.einsum("iww->iw", self.compliance)

    @cached_property
    def lift(self) -> np.ndarray:
        """Lift of a head by a unit force if it touches all contact wires, (n,) [m/N]; with a single
        wire the compliance of the wire."""
        return self.pressed(np.zeros(self.compliance.shape[:2]), 1.0)

    def pressed(self, height: np.ndarray, force: float) -> np.ndarray:
        """Height of a head that presses with a static force, (n,) [m].

        It divides the force among the contact wires that it touches, none of which pulls it.

        Parameters
        ----------
        height : ndarray, shape (n, w)
            Heights of the wires at rest [m].
        force : float
            Static force [N].
        """
        if height.shape[1] == 1:
            return np.asarray(height[:, 0] + force * self.compliance[:, 0, 0])
        return np.array(
            [
                _under(of_place, matrix, force)
                for of_place, matrix in zip(height, self.compliance, strict=True)
            ]
        )


def elasticity(model: Model, x_from: float, x_to: float) -> Elasticity:
    """Static lift under unit forces where contact wires have nodes in [x_from, x_to] [m].

    Droppers taut, arms included. The line outside is condensed to the unknowns that it is joined
    to; then there is a small solve for each place. Of a long line that is as much of it as moves by
    more than round-off, and a long stretch is taken in parts. Each wire gives way by itself, also
    one that moves with another. Not collective.

    Raises
    ------
    InputError
        If the line is unstable.
    """
    model = with_wires_apart(model)
    cuts = np.linspace(x_from, x_to, 1 + max(1, math.ceil((x_to - x_from) / _LONGEST)))
    stiffness = OperatorBands(model, (0.0, 1.0, 0.0))
    parts = [_of_stretch(model, stiffness, *ends) for ends in itertools.pairwise(cuts.tolist())]
    x = np.concatenate([part.x for part in parts])
    once = np.diff(x, prepend=-np.inf) > SAME_PLACE  # a node at a cut is in both parts
    return Elasticity(x[once], np.concatenate([part.compliance for part in parts])[once])


def _of_stretch(model: Model, stiffness: OperatorBands, x_from: float, x_to: float) -> Elasticity:
    """The lift in a stretch that is solved as a whole."""
    x = _places_in(model, x_from, x_to)
    wires = [wire.name for wire in model.problem.line.wires_of(Role.CONTACT)]
    places = [at_places(model, wire, x) for wire in wires]
    present = np.stack([_is_there(model, wire, x) for wire in wires], axis=1)
    x_from, x_to = _element_ends(model, x_from, x_to)
    try:
        first, factor = _seen_from(model, stiffness, x_from, x_to)
    except linalg.LinAlgError as error:
        raise InputError(
            "the contact wires have no elasticity: the line at rest is unstable"
        ) from error
    # A held wire does not give way; the one that the matrix has there is no spring.
    weights = [
        np.where(np.isin(place.unknowns, model.constrained), 0.0, place.weights) for place in places
    ]
    unknowns = [
        np.where(own != 0.0, place.unknowns - first, 0)
        for place, own in zip(places, weights, strict=True)
    ]
    compliance = np.full((x.size, len(places), len(places)), np.nan)
    size, pressed = factor.shape[1], np.argwhere(present)
    for some in np.array_split(pressed, 1 + pressed.shape[0] * size // _AT_ONCE):
        loads = np.zeros((len(some), size))
        for load, (i, j) in zip(loads, some, strict=True):
            np.add.at(load, unknowns[j][i], weights[j][i])
        moved = linalg.cho_solve_banded((factor, True), loads.T, overwrite_b=True).T
        for motion, (i, j) in zip(moved, some, strict=True):
            for k in np.flatnonzero(present[i]):
                compliance[i, k, j] = motion[unknowns[k][i]] @ weights[k][i]
    return Elasticity(x, compliance)


def _under(height: np.ndarray, compliance: np.ndarray, force: float) -> float:
    """Height of a head under wires of these heights (w,) [m], which are NaN where none is.

    Of all sets of wires that it may touch the one in which no wire pulls it down and no other one
    hangs lower.
    """
    there = np.flatnonzero(np.isfinite(height) & np.isfinite(np.diagonal(compliance)))
    found, least = np.nan, np.inf
    for size in range(1, there.size + 1):
        for touched in map(list, itertools.combinations(there.tolist(), size)):
            system = np.zeros((size + 1, size + 1))
            system[:size, :size] = compliance[np.ix_(touched, touched)]
            system[:size, size], system[size, :size] = -1.0, 1.0
            try:
                solved = np.linalg.solve(system, np.append(-height[touched], force))
            except np.linalg.LinAlgError:  # two wires that do not give way
                continue
            own, head = solved[:-1], float(solved[-1])
            others = np.setdiff1d(there, touched)
            wires = height[others] + compliance[np.ix_(others, touched)] @ own
            # In metres: how far a wire that pulls is from where it would hang.
            pulls = -own * np.diagonal(compliance)[touched]
            wrong = max(pulls.max(initial=0.0), (head - wires).max(initial=0.0))
            if wrong < least:
                found, least = head, wrong
    return found


def _places_in(model: Model, x_from: float, x_to: float) -> np.ndarray:
    """Places of the contact wires' nodes in a stretch, each once, (n,) [m]."""
    x = np.sort(model.mesh.x(np.concatenate(model.nodes_of(Role.CONTACT))))
    x = x[(x >= x_from - 1e-9) & (x <= x_to + 1e-9)]
    return np.asarray(x[np.diff(x, prepend=-np.inf) > SAME_PLACE])


def _is_there(model: Model, wire: str, x: np.ndarray) -> np.ndarray:
    """Whether one of the pieces of a wire runs over places, (n,) bool."""
    ends = (model.mesh.x(piece)[[0, -1]] for piece in model.mesh.pieces(wire))
    return np.any([(x >= a - SAME_PLACE) & (x <= b + SAME_PLACE) for a, b in ends], axis=0)


def _element_ends(model: Model, x_from: float, x_to: float) -> tuple[float, float]:
    """The stretch with the elements of contact wires that begin or end beyond it [m]."""
    low, high = [x_from], [x_to]
    for nodes in model.nodes_of(Role.CONTACT):
        x = model.mesh.x(nodes)
        low.append(x[max(int(np.searchsorted(x, x_from)) - 1, 0)])
        high.append(x[min(int(np.searchsorted(x, x_to, side="right")), x.size - 1)])
    return float(min(low)), float(max(high))


def _seen_from(
    model: Model, stiffness: OperatorBands, x_from: float, x_to: float
) -> tuple[int, np.ndarray]:
    """Stiffness of what stands in a stretch, all else eliminated: its first unknown, and lower
    bands of Cholesky's factor."""
    numbering, width, reach = model.numbering, model.numbering.width, _FIRST_REACH
    first, last = numbering.within(x_from, x_to)
    while True:
        low, high = numbering.within(x_from - reach, x_to + reach)
        bands = stiffness.between(low, high, numbering.size)
        # So wide that nothing before it is joined to anything behind it.
        more = len(bands)
        begin = first - more if first - low > 2 * more else low
        end = last + more if high - last > 2 * more else high
        condensed, before, behind = _condensed(bands, begin - low, end - low)
        # Motion at the ends of the examined stretch, wherever the line goes on there.
        ends = [before[:width]] if low > 0 else []
        ends += [behind[-width:]] if high < numbering.size else []
        most = _STILL * max(np.abs(motion).max(initial=0.0) for motion in (before, behind))
        if all(np.abs(motion).max(initial=0.0) <= most for motion in ends):
            return begin, linalg.cholesky_banded(condensed, overwrite_ab=True, lower=True)
        reach *= 4.0


def _condensed(
    bands: np.ndarray, first: int, last: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows and columns ``first`` to ``last`` of a symmetric matrix in lower bands, the others
    eliminated.

    Also how those before and those behind them move with the unknowns that they are joined to.
    """
    size, k = bands.shape[1], len(bands) - 1
    inner = bands[:, first:last].copy()
    before = behind = np.zeros((0, k))
    if first > 0:
        pulls = np.zeros((first, k))
        pulls[-k:] = _across(bands, first).T
        before = linalg.solveh_banded(bands[:, :first], pulls, lower=True)
        _subtract(inner[:, :k], pulls[-k:].T @ before[-k:])
    if last < size:
        pulls = np.zeros((size - last, k))
        pulls[:k] = _across(bands, last)
        behind = linalg.solveh_banded(bands[:, last:], pulls, lower=True)
        _subtract(inner[:, -k:], pulls[:k].T @ behind[:k])
    return inner, before, behind


def _across(bands: np.ndarray, cut: int) -> np.ndarray:
    """Entries (k, k) of a matrix in lower ``bands`` in the k rows from ``cut`` on and the k columns
    before it."""
    k = len(bands) - 1
    row, column = np.indices((k, k))
    return np.where(row <= column, bands[np.minimum(k + row - column, k), cut - k + column], 0.0)


def _subtract(bands: np.ndarray, change: np.ndarray) -> None:
    """Subtract a symmetric matrix (k, k) from the k columns of lower ``bands`` where it stands."""
    for number in range(len(change)):
        bands[number, : len(change) - number] -= np.diagonal(change, -number)


def middle_span(line: Line) -> tuple[float, float]:
    """Ends of the running span in the middle of the line, outside overlaps [m].

    Of the spans that the fewest contact wires reach, it is the one that is nearest to the middle.
    """
    masts = line.support_positions
    first, last = line.n_transition[0], line.n_spans - line.n_transition[1]
    wires = np.zeros(line.n_spans)
    for piece in (piece for wire in line.wires_of(Role.CONTACT) for piece in wire.pieces):
        begun = masts[:-1] < piece.x[-1] + SAME_PLACE
        wires += begun & (masts[1:] > piece.x[0] - SAME_PLACE)
    running = np.arange(first, last)
    fewest = running[wires[first:last] == wires[first:last].min()]
    span = int(fewest[np.argmin(np.abs(fewest - (first + last) // 2))])
    return float(masts[span]), float(masts[span + 1])
