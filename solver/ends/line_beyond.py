"""The periodic line beyond an end of a model: spans of one kind, and where they begin.

The line beyond is that of the span next to the last one, over and over: on both sides of it stands
a span. The last span of the model must be of its kind, or its mirror image, as spans of a zig-zag
are: with lateral unknowns of every second span the other way round all are alike then.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.solver.ends.half_lines import SpanMatrices, span_matrices
from catenary.solver.model.entries import iterate_sums
from catenary.solver.model.model import Model

# Difference of two spans of a kind, over the largest entry: dropper lengths differ by millimetres
# where a line ends.
_ALIKE = 0.02
_TINY = 1e-6  # [m]

# Unknowns that have the other sign in a mirror image.
_LATERAL = ("v", "theta_z")

START, END = 0, 1
SIDES = ("start", "end")


class LineBeyond(NamedTuple):
    """Half line beyond an end.

    Attributes
    ----------
    unknowns : (m,) unknowns of the model at its end that it shares with the line beyond
    here : (3, m, m) M, C and K of the model at these unknowns without the line beyond
    span : SpanMatrices of the line beyond, ordered from the start of the line
    held : unknowns of the model at its end that are held at masts of the line beyond
    """

    unknowns: np.ndarray
    here: np.ndarray
    span: SpanMatrices
    held: np.ndarray


def line_beyond(model: Model, side: int, held: np.ndarray) -> LineBeyond:
    """Periodic half line beyond the ``START`` or ``END`` of a model. Not collective.

    Parameters
    ----------
    model : Model
        Discrete line.
    side : int
        ``START`` or ``END``.
    held : ndarray, shape (n,)
        Unknowns that are held between the ends; of the ends themselves none are left out.

    Raises
    ------
    InputError
        If the two spans there are not of one kind, or nodes of the wires do not stand side by side.
    """
    masts, n = model.problem.line.support_positions, model.problem.line.n_spans
    where = f"line.ends.{SIDES[side]}.kind is periodic, which repeats the span next to the last one"
    if n < 3:
        raise InputError(f"{where}, but the line has less than 3 spans (line.n_spans)")
    # From inside to the end: the span that is repeated, and the last one.
    marks = [masts[n - 2], masts[n - 1], masts[n]] if side == END else list(masts[2::-1])
    if abs(abs(marks[1] - marks[0]) - abs(marks[2] - marks[1])) > _TINY:
        raise InputError(
            f"{where}: that has {abs(marks[1] - marks[0]):g} m and the last one "
            f"{abs(marks[2] - marks[1]):g} m; give both one length"
        )
    first, low, high = sorted(marks)
    numbering = model.numbering
    begins = [numbering.first_at(x) for x in (first, low, high)]
    size = begins[1] - begins[0]
    last = numbering.size if side == END else begins[2] + size
    at_end = begins[2] if side == END else begins[0]
    try:
        if begins[2] - begins[1] != size or numbering.size - begins[2] < 1:
            raise InputError("it has other nodes than the last one")
        # Rows of the repeated span, and columns up to the next cross-section.
        start = begins[0] if side == END else begins[1]
        whole = _matrices(model, start, start + size, start, start + 2 * size)
        joins = np.flatnonzero(whole[:, :, size:].any(axis=(0, 1)))
        own, joined = _without(whole, start, held)
        shared = np.flatnonzero(joined.any(axis=(0, 1)))
        other = begins[1] if side == END else begins[0]
        beside = _matrices(model, other, other + size, other, other + size)
        beside, _ = _without(beside, other, held)
        signs = sideways(model, start + np.arange(size))
        if _mirrored(own, beside, joins, signs, model.simulated.wind is not None):
            # Counted from the end of the model, every second cross-section is the other way round.
            if side == START:
                own, joined = own * signs[:, None] * signs, joined * signs[:, None]
            else:
                joined = joined * signs
        span = span_matrices(own, joined, shared)
        unknowns, everything = at_end + shared, at_end + joins
        if everything[-1] >= last or (_places(model, everything) != _places(model, start + joins)):
            raise InputError("wires end elsewhere than at its masts")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    here = _matrices(model, at_end, int(unknowns[-1]) + 1, at_end, int(unknowns[-1]) + 1)
    here = here[:, shared][:, :, shared]
    return LineBeyond(unknowns, here, span, np.setdiff1d(everything, unknowns))


def span_between(model: Model, mast: float, following: float) -> tuple[np.ndarray, SpanMatrices]:
    """Unknowns (m,) that a span shares at its first mast, and its matrices. Not collective.

    Nothing is left out, whatever effects hold.

    Parameters
    ----------
    model : Model
        Discrete line.
    mast, following : float
        Places of both masts along the track [m].

    Raises
    ------
    InputError
        If spans are joined by more than a cross-section at a mast.
    """
    first, last = model.numbering.first_at(mast), model.numbering.first_at(following)
    end = min(model.numbering.size, 2 * last - first)
    whole = np.zeros((3, last - first, 2 * (last - first)))
    whole[:, :, : end - first] = _matrices(model, first, last, first, end)
    own, joined = whole[:, :, : last - first], whole[:, :, last - first :]
    shared = np.flatnonzero(joined.any(axis=(0, 1)))
    return first + shared, span_matrices(own, joined, shared)


def shared_at(model: Model, unknowns: np.ndarray) -> np.ndarray:
    """M, C and K of some neighbouring unknowns, (3, m, m), held ones included. Not collective."""
    low, high = int(unknowns[0]), int(unknowns[-1]) + 1
    at = unknowns - low
    return _matrices(model, low, high, low, high)[:, at][:, :, at]


def _without(whole: np.ndarray, first: int, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices of unknowns from ``first`` on without held ones, whose rows and columns are empty:
    those of the span itself, and what joins it with the next one, if ``whole`` has that."""
    _, size, n = whole.shape
    free = ~np.isin(first + np.arange(n), held)
    whole = whole * free[:size, None] * free
    return whole[:, :, :size], whole[:, :, size:]


def sideways(model: Model, unknowns: np.ndarray) -> np.ndarray:
    """-1 for lateral ones of some ``unknowns`` (m,), 1 for others. Not collective."""
    names = [name for name in _LATERAL if name in model.unknowns]
    every = np.arange(model.mesh.n_nodes)
    lateral = [model.dofs(every[model.numbering.has(every, name)], name) for name in names]
    found = np.isin(unknowns, np.concatenate([np.zeros(0, int), *lateral]))
    return np.where(found, -1.0, 1.0)


def _mirrored(
    own: np.ndarray, beside: np.ndarray, at_mast: np.ndarray, signs: np.ndarray, is_windy: bool
) -> bool:
    """Whether a span is the mirror image of the one beside it, the cross-section at the mast left
    out. With ``is_windy`` the refusal names the wind.

    Raises
    ------
    InputError
        If it is neither that nor of the same kind.
    """
    inner = np.setdiff1d(np.arange(own.shape[1]), at_mast)
    image = own * signs[:, None] * signs
    differences = []
    for ours in (own, image):
        pairs = zip(ours[:, inner][:, :, inner], beside[:, inner][:, :, inner], strict=True)
        differences.append(max(_difference(one, other) for one, other in pairs))
    same, mirrored = differences
    if min(same, mirrored) > _ALIKE:
        blown = ", as the mean wind (wind) makes spans of a zig-zag" if is_windy else ""
        raise InputError(f"the last one is of another kind{blown}")
    return mirrored < same


def _difference(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of two matrices over the largest entry of the first."""
    largest = float(np.abs(one).max())
    return float(np.abs(one - other).max()) / largest if largest else float((other != 0.0).any())


def _places(model: Model, unknowns: np.ndarray) -> list[tuple[int, str]]:
    numbers, found = model.numbering.numbers, []
    wire_of = np.full(model.mesh.n_nodes, -1)
    for number, nodes in enumerate(model.mesh.wires.values()):
        wire_of[nodes] = number
    for unknown in unknowns.tolist():
        nodes, columns = np.nonzero(numbers == unknown)
        found += [(int(wire_of[n]), model.unknowns[c]) for n, c in zip(nodes, columns, strict=True)]
    return found


def _matrices(model: Model, first: int, last: int, low: int, high: int) -> np.ndarray:
    """M, C and K of rows [first, last) and columns [low, high), (3, n, m), held ones included."""
    result = np.zeros((3, last - first, high - low))
    kinds = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    for rows, columns, values in iterate_sums(model, first, last, kinds):
        near = (columns >= low) & (columns < high)
        at = rows[near] - first, columns[near] - low
        for matrix, own in zip(result, values[:, near], strict=True):
            np.add.at(matrix, at, own)
    return result
