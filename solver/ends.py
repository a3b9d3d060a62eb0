"""Line beyond an end: half lines of a periodic line, and their forces in steps.

Half lines. Spans that are alike, each condensed to the unknowns that it shares with the next one,
make a chain

    B u_(j-1) + S u_j + B^T u_(j+1) = f_j .

Condensing every second one of these leaves a chain of spans twice as long, whose coupling falls
with the square each time as soon as waves fade along it (cyclic reduction; R. W. Hockney, J. ACM
12, 1965). What is left at the first one is the stiffness of the half line, at any frequency.

The line beyond an end of a model is that of the span next to the last one, over and over: on both
sides of it stands a span. The last span of the model must be of its kind, or its mirror image, as
spans of a zig-zag are: with lateral unknowns of every second span the other way round all are alike
then.

In steps of Newmark's family the end is stiffness and memory. A step's formulas make displacement
and velocity where a line ends sums over the accelerations b that balanced the forces there,
d^ = p_u b^ and v^ = p_v b^ in terms of generating functions x^(zeta) = sum of x_n zeta^n. The half
line beyond, which is stepped alike, then answers with the force

    f^ = -G(zeta) b^,       G: half line of M + p_v C + p_u K        (eliminated exactly)

Of G the static stiffness K0, C0 = alpha K0 + beta M0 and a mass M0 go into the line's matrices,
M0 being what makes the step's own part right, G(0) = M0 + tau C0 + sigma K0. The rest is a sum over
the past, with numbers Q_j that are found on a circle within the unit circle (C. Lubich, Numer.
Math. 52, 1988): nothing is reflected but round-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import fft

from catenary.base.errors import InputError
from catenary.meshgen.wires import SAME_PLACE
from catenary.solver.kernels import native
from catenary.solver.model.matrices import iterate_sums
from catenary.solver.model.model import Model
from catenary.solver.model.unknowns import LEVEL, wire_of_node
from catenary.solver.problem.integrator_parameters import Integration

# Coupling over diagonal at which the rest of a half line is round-off, squared in another pass; and
# the most passes: spans are 2^40 times as long then.
_ROUND_OFF, _MOST_PASSES = 1e-9, 40
# Unknowns that an element may join, twice a station's: four in lateral motion of six wires.
_MOST_WIDE = 47
# Difference of two spans of a kind, over the largest entry: dropper lengths differ by millimetres
# where a line ends.
_ALIKE = 0.02
# Radius^(2 n) of the circle for n numbers: what aliases, and the square of what round-off grows by.
_ALIASED = 1e-12
# Frequencies at a time.
_AT_ONCE = 1024

START, END = 0, 1
SIDES = ("start", "end")


class SpanMatrices(NamedTuple):
    """A span between two cross-sections, c + m unknowns: M, C and K, one after the other.

    The m unknowns that a span shares with the one before it stand apart from its c others, which
    are ordered along the track.

    Attributes
    ----------
    bands : (3, c, b + 1) lower bands of the c others: ``bands[:, r, b - d]`` joins r and r - d
    start, end : (3, c, m) coupling of the c others to the m unknowns at the start and at the end
    corner : (3, m, m) block of the m unknowns at the start, contributions of both spans summed
    across : (3, m, m) direct coupling of the start (rows) to the end (columns)
    """

    bands: np.ndarray
    start: np.ndarray
    end: np.ndarray
    corner: np.ndarray
    across: np.ndarray


class Chain(NamedTuple):
    """Spans condensed to their m shared unknowns, at n frequencies.

    Attributes
    ----------
    corner : (n, m, m) dynamic stiffness of the shared unknowns before condensation
    start, end : (n, m, m) reduction of ``corner`` by condensing a span, at its start and at its end
    next : (n, m, m) coupling of a cross-section (rows) to the next one (columns)
    """

    corner: np.ndarray
    start: np.ndarray
    end: np.ndarray
    next: np.ndarray


def span_matrices(own: np.ndarray, joined: np.ndarray, shared: np.ndarray) -> SpanMatrices:
    """A span in the form that is condensed.

    Parameters
    ----------
    own : ndarray, shape (3, n, n)
        Matrices of the span's unknowns.
    joined : ndarray, shape (3, n, n)
        Rows of these with columns of the next span's.
    shared : ndarray, shape (m,)
        Unknowns that the span shares with the one before.

    Raises
    ------
    InputError
        If spans share more than what is shared with the one before.
    """
    if np.delete(joined, shared, axis=2).any():
        raise InputError("its spans are joined by more than one cross-section")
    others = np.setdiff1d(np.flatnonzero(own[0].diagonal() > 0.0), shared)
    inner = own[:, others][:, :, others]
    rows, columns = np.nonzero(inner.any(axis=0))
    width = int(np.abs(rows - columns).max(initial=0))
    if width > _MOST_WIDE:
        raise InputError("its nodes do not stand side by side")
    bands = np.zeros((3, others.size, width + 1))
    for d in range(width + 1):
        bands[:, d:, width - d] = np.diagonal(inner, -d, axis1=1, axis2=2)
    return SpanMatrices(
        bands,
        np.ascontiguousarray(own[:, others][:, :, shared]),
        np.ascontiguousarray(joined[:, others][:, :, shared]),
        np.ascontiguousarray(own[:, shared][:, :, shared]),
        np.ascontiguousarray(joined[:, shared][:, :, shared]),
    )


def chain_at(span: SpanMatrices, weights: np.ndarray) -> Chain:
    """Spans condensed at n frequencies; ``weights`` (n, 3) are complex factors of M, C and K."""
    m = span.corner.shape[1]
    taken = np.zeros((weights.shape[0], 2 * m, 2 * m), dtype=complex)
    beside = np.concatenate([span.start, span.end], axis=2)
    native.condense_spans(weights, span.bands, beside, taken)
    corner, across = (
        np.einsum("nw,wij->nij", weights, part) for part in (span.corner, span.across)
    )
    return Chain(corner, taken[:, :m, :m], taken[:, m:, m:], across - taken[:, :m, m:])


def half_lines(chain: Chain) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness of the half lines after and before a cross-section, (n, m, m) each.

    Each includes ``corner``, to which the elements on both sides of the cross-section contribute.

    Raises
    ------
    InputError
        If the response to a force there does not decay along the line at one of the frequencies.
    """
    after, before = chain.corner - chain.start, chain.corner - chain.end
    here = after - chain.end
    ahead, back = chain.next, np.swapaxes(chain.next, 1, 2)
    for _ in range(_MOST_PASSES):
        # Slopes and deflections differ in unit: products of coupling are compared, not coupling.
        to_ahead, to_back = np.linalg.solve(here, ahead), np.linalg.solve(here, back)
        forth, round_trip = ahead @ to_back, back @ to_ahead
        after, before = after - forth, before - round_trip
        here = here - forth - round_trip
        ahead, back = -ahead @ to_ahead, -back @ to_back
        left = np.abs(forth).max(axis=(1, 2)) / np.abs(after).max(axis=(1, 2))
        if left.max() < _ROUND_OFF**2:
            return after, before
    raise InputError("what acts on one of its cross-sections does not fade along it")


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
    if abs(abs(marks[1] - marks[0]) - abs(marks[2] - marks[1])) > SAME_PLACE:
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
        whole = matrices_between(model, start, start + size, start, start + 2 * size)
        joins = np.flatnonzero(whole[:, :, size:].any(axis=(0, 1)))
        own, joined = _without(whole, start, held)
        shared = np.flatnonzero(joined.any(axis=(0, 1)))
        other = begins[1] if side == END else begins[0]
        beside = matrices_between(model, other, other + size, other, other + size)
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
    here = matrices_between(model, at_end, int(unknowns[-1]) + 1, at_end, int(unknowns[-1]) + 1)
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
    whole[:, :, : end - first] = matrices_between(model, first, last, first, end)
    own, joined = whole[:, :, : last - first], whole[:, :, last - first :]
    shared = np.flatnonzero(joined.any(axis=(0, 1)))
    return first + shared, span_matrices(own, joined, shared)


def shared_at(model: Model, unknowns: np.ndarray) -> np.ndarray:
    """M, C and K of some neighbouring unknowns, (3, m, m), held ones included. Not collective."""
    low, high = int(unknowns[0]), int(unknowns[-1]) + 1
    at = unknowns - low
    return matrices_between(model, low, high, low, high)[:, at][:, :, at]


def _without(whole: np.ndarray, first: int, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Matrices of unknowns from ``first`` on without held ones, whose rows and columns are empty:
    those of the span itself, and what joins it with the next one, if ``whole`` has that."""
    _, size, n = whole.shape
    free = ~np.isin(first + np.arange(n), held)
    whole = whole * free[:size, None] * free
    return whole[:, :, :size], whole[:, :, size:]


def sideways(model: Model, unknowns: np.ndarray) -> np.ndarray:
    """-1 for lateral ones of some ``unknowns`` (m,), which have the other sign in a mirror image,
    1 for others. Not collective."""
    names = [name for name in LEVEL if name in model.unknowns]
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
    numbers, wire_of, found = model.numbering.numbers, wire_of_node(model.mesh), []
    for unknown in unknowns.tolist():
        nodes, columns = np.nonzero(numbers == unknown)
        found += [(int(wire_of[n]), model.unknowns[c]) for n, c in zip(nodes, columns, strict=True)]
    return found


def matrices_between(model: Model, first: int, last: int, low: int, high: int) -> np.ndarray:
    """M, C and K of rows [first, last) and columns [low, high), (3, n, m), held ones included."""
    result = np.zeros((3, last - first, high - low))
    kinds = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    for rows, columns, values in iterate_sums(model, first, last, kinds):
        near = (columns >= low) & (columns < high)
        at = rows[near] - first, columns[near] - low
        for matrix, own in zip(result, values[:, near], strict=True):
            np.add.at(matrix, at, own)
    return result


@dataclass(frozen=True)
class StepSums:
    """Recursion of velocity and displacement in steps of ``dt`` [s]."""

    dt: float
    integration: Integration

    def velocity_and_position(self, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """p_v [s] and p_u [s2] at points (n,) within the unit circle, (n,) each."""
        beta, gamma, mass_weight, force_weight = self.integration
        # The method's own acceleration, of which b is the balanced one.
        own = (1.0 - force_weight + force_weight * zeta) / (1.0 - mass_weight + mass_weight * zeta)
        velocity = self.dt * (gamma + (1.0 - gamma) * zeta) / (1.0 - zeta)
        position = self.dt * zeta * velocity + self.dt**2 * (beta + (0.5 - beta) * zeta)
        return own * velocity, own * position / (1.0 - zeta)


@dataclass(frozen=True)
class PeriodicEnd:
    """One end with a periodic line beyond, m shared unknowns.

    Attributes
    ----------
    beyond : the line beyond
    side : START or END
    damping : alpha [s] and beta [1/s] of C0 = alpha K0 + beta M0
    sums : displacement and velocity as sums over the accelerations of the steps
    mass, stiffness : (m, m) M0 and K0
    """

    beyond: LineBeyond
    side: int
    damping: tuple[float, float]
    sums: StepSums
    mass: np.ndarray
    stiffness: np.ndarray

    @property
    def unknowns(self) -> np.ndarray:
        """(m,) of the model, where it ends."""
        return self.beyond.unknowns

    def memory(self, n: int) -> np.ndarray:
        """Q_0 to Q_(n-1), (n, m, m): force by a unit acceleration j steps ago [N s2/m].

        Q_0 is zero, as the matrices contain it. Not collective.
        """
        size = fft.next_fast_len(max(2 * n, 16), real=True)
        radius = _ALIASED ** (1.0 / size)
        turns = np.arange(size // 2 + 1) / size
        zeta = radius * np.exp(-2j * np.pi * turns)
        m = self.unknowns.size
        values = np.empty((zeta.size, m, m), dtype=complex)
        for first in range(0, zeta.size, _AT_ONCE):
            part = zeta[first : first + _AT_ONCE]
            velocity, position = self.sums.velocity_and_position(part)
            alpha, beta = self.damping
            kept = np.multiply.outer(1.0 + beta * velocity, self.mass)
            kept += np.multiply.outer(position + alpha * velocity, self.stiffness)
            values[first : first + _AT_ONCE] = (
                half_line(self.beyond, self.side, np.ones_like(part), velocity, position) - kept
            )
        numbers = fft.irfft(values, size, axis=0)[:n]
        numbers /= (radius ** np.arange(n))[:, None, None]
        numbers[0] = 0.0
        return np.asarray(0.5 * (numbers + np.swapaxes(numbers, 1, 2)))


def half_line(
    beyond: LineBeyond, side: int, mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray
) -> np.ndarray:
    """Dynamic stiffness (n, m, m) of the line beyond a ``side``, ``START`` or ``END``.

    ``mass``, ``damping`` and ``stiffness`` (n,) are the real or complex factors of M, C and K.
    """
    weights = np.stack([mass, damping, stiffness], axis=1).astype(complex)
    after, before = half_lines(chain_at(beyond.span, weights))
    here = np.einsum("nw,wij->nij", weights, beyond.here)
    return (after if side == END else before) - here


def periodic_end(
    beyond: LineBeyond, side: int, damping: tuple[float, float], sums: StepSums
) -> PeriodicEnd:
    """The end of a line that goes on as ``beyond``. Not collective.

    Parameters
    ----------
    beyond : LineBeyond
        The half line beyond the end.
    side : int
        ``START`` or ``END``.
    damping : tuple of float
        alpha [s] and beta [1/s] of the line, for the part of its damping that the matrices contain.
    sums : StepSums
        Displacement and velocity as sums over the accelerations of the steps.

    Raises
    ------
    InputError
        If the response to a force at the end does not decay along the line.
    """
    zero, one = np.zeros(1), np.ones(1)
    stiffness = half_line(beyond, side, zero, zero, one)[0].real
    tau, sigma = sums.velocity_and_position(np.zeros(1))
    of_step = half_line(beyond, side, one, tau, sigma)[0].real
    alpha, beta = damping
    mass = (of_step - (sigma + tau * alpha) * stiffness) / (1.0 + tau * beta)
    return PeriodicEnd(beyond, side, damping, sums, _symmetric(mass), _symmetric(stiffness))


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (matrix + matrix.T))
