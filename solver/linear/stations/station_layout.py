"""How the unknowns of a station stand in vector lanes, and how blocks are packed for products.

Kernels are compiled for the widths of the shipped kinds of lines (``known_layouts.hpp``), in which
``layout.hpp`` has the same lanes and the same order. All other layouts are general ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from catenary.solver.kernels import native

# Lanes that a plane may take: the least of these that holds its unknowns.
LANES = (2, 4, 6, 8, 10, 12, 16)
# Unknowns of a plane, planes and lanes of a station, that kernels take.
WIDEST, MOST_PLANES, MOST_LANES = LANES[-1], 8, 32
# Lanes of a register, at most; more are held in several, whose sizes are powers of two.
REGISTER = 8
# Lanes of each register of a general layout.
_GENERAL = 4
# Parameters of a layout.
_SETTINGS = ("widths", "own", "beside", "damped", "make_ups", "sparse", "strands")


class Terms(NamedTuple):
    """What a block times a vector is the sum of, and how its numbers are stored.

    In term k each lane is multiplied with the number of lane ``sources[k]`` of the vector, and
    counts for lane ``targets[k]`` of the result. There are two sums, which a processor works on
    side by side; the lanes of the second are exchanged at the end, all at once.

    Attributes
    ----------
    sources : (n_terms, n_lanes) int, -1 where there is no such lane
    targets : (n_terms, n_lanes) int
    sums : (n_terms,) which sum each belongs to, 0 or 1
    """

    sources: np.ndarray
    targets: np.ndarray
    sums: np.ndarray


class Halves(NamedTuple):
    """What a symmetric block times a vector is the sum of, of which one half is stored.

    Term k is as one of ``Terms`` whose targets are the lanes themselves. Where it is ``mirrored``,
    its numbers times the vector, with lane ``back[k]`` of these products in each lane, are what
    the other half makes. ``share`` is what of a number is stored: a half where both come to the
    same.

    Attributes
    ----------
    sources : (n_terms, n_lanes) int, -1 where there is no such lane
    back : (n_terms, n_lanes) int, a lane of products that are zero where there is none
    mirrored : (n_terms,) bool
    share : (n_terms, n_lanes)
    """

    sources: np.ndarray
    back: np.ndarray
    mirrored: np.ndarray
    share: np.ndarray


class Order(NamedTuple):
    """In which order a packed block has its numbers.

    Attributes
    ----------
    begins : (n_registers, n_terms) int, where those of each register and term begin, -1 if there
        are none
    size : how many the block has
    """

    begins: np.ndarray
    size: int


class Layout:
    """How the unknowns of a station stand in lanes, and which of them matrices join.

    Planes are sets of unknowns that no matrix joins. They stand side by side, each in as many lanes
    as it needs, so that one instruction may work on several. A block of a matrix is kept by terms,
    see ``Terms``. Each joins lanes whose places in their plane differ by one number, in the sense
    of exclusive or: 0 those with themselves, 1 a beam's deflection and slope, 2 the deflections of
    two wires.

    Parameters
    ----------
    widths : unknowns of a station in each plane, as they follow each other in vectors
    own, beside : numbers of the terms that K and C have within a station, and between a station
        and those beside it; all of them by default
    damped : whether a product with K is one with C as well
    sparse : whether factors keep the matrix's own blocks between stations, of the terms
        ``beside``, in place of products with these, which join all of a plane, and of S^-1 one half
    strands : sets of unknowns, of one plane each, to whose own the blocks between stations join
        them, as those of a wire; terms are then by the columns of all sets at once, in place of
        ``beside``
    make_ups : places in a cross-section that stations of each make-up have; none if all have all

    Attributes
    ----------
    pitch : unknowns of a cross-section
    general : whether no kernels were compiled for these widths
    n_lanes : lanes that they take, those without an unknown included
    registers : lanes of each of the vectors that hold these, see ``registers_of``
    turns : whether lanes 0 and 1, 2 and 3 and so on of a second sum are exchanged
    whole, places, number : of one of its ``parts``: what it is a part of, which unknowns of that it
        has, and of which make-up it is
    """

    whole: Layout | None = None
    places: tuple[int, ...] = ()
    number: int = 0

    def __init__(
        self,
        widths: tuple[int, ...],
        own: tuple[int, ...] | None = None,
        beside: tuple[int, ...] | None = None,
        damped: bool = False,
        make_ups: tuple[tuple[int, ...], ...] = (),
        sparse: bool = False,
        strands: tuple[tuple[int, ...], ...] = (),
    ) -> None:
        self.widths = tuple(widths)
        self.general = not native.has_widths(self.widths)
        self._planes = _general_lanes(self.widths) if self.general else lanes_of(self.widths)
        largest = _power(max(self._planes))
        every = tuple(range(largest))
        self.own = every if own is None else tuple(own)
        self.beside = every if beside is None else tuple(beside)
        self.damped, self.make_ups, self.sparse = bool(damped), make_ups, bool(sparse)
        self.strands = strands
        self.pitch = sum(self.widths)
        self.n_lanes = sum(self._planes)
        # Columns where there are fewer of these than of differences.
        self.turns = not self.general and largest <= REGISTER and max(self.widths) > largest - 2
        self._first = np.repeat(np.cumsum([0, *self._planes[:-1]]), self._planes)
        self._end = self._first + np.repeat(self._planes, self._planes)
        if self.general:
            self.registers: tuple[int, ...] = (_GENERAL,) * (self.n_lanes // _GENERAL)
        else:
            self.registers = registers_of(self.widths)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Layout) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)

    @property
    def key(self) -> tuple[object, ...]:
        """All that makes a layout."""
        own = tuple(getattr(self, name) for name in _SETTINGS)
        return own if self.whole is None else (*own, self.number, self.whole.key)

    def changed(self, **settings: Any) -> Layout:
        """The same with some other parameters, by their names."""
        return Layout(**{**{name: getattr(self, name) for name in _SETTINGS}, **settings})

    @property
    def n_terms(self) -> int:
        """Terms of a row of K or C."""
        return len(self.own) + 2 * len(self.beside)

    @property
    def row_size(self) -> int:
        """Numbers of a packed row of K or C."""
        own, beside = (
            self.order_of(terms.sources) for terms in (self.own_terms, self.beside_terms)
        )
        return own.size + 2 * beside.size

    @property
    def n_terms_beside(self) -> int:
        """Terms of a row of a block between stations."""
        return len(self.beside_terms.sources)

    @property
    def varies(self) -> bool:
        """Whether stations are of several make-ups, of which this may be one."""
        return bool(self.make_ups) or self.whole is not None

    @cached_property
    def parts(self) -> tuple[Layout, ...]:
        """Layouts of each make-up; if there is one only, this itself."""
        return tuple(self._part(n) for n in range(len(self.make_ups))) or (self,)

    def _part(self, number: int) -> Layout:
        places = np.array(self.make_ups[number])
        planes = np.searchsorted(np.cumsum(self.widths), places, side="right")
        widths = tuple(int(width) for width in np.bincount(planes) if width)
        settings: dict[str, Any] = {"damped": self.damped, "sparse": self.sparse}
        place_of = {int(place): at for at, place in enumerate(places)}
        kept = (tuple(place_of[u] for u in strand if u in place_of) for strand in self.strands)
        settings["strands"] = tuple(strand for strand in kept if strand)
        part = Layout(widths, (), (), **settings)
        lane = self._lane_of[places]
        apart, together = lane[:, None] ^ lane, planes[:, None] == planes
        own = part.differences(np.isin(apart, self.own) & together)
        beside = part.differences(np.isin(apart, self.beside) & together)
        part = Layout(widths, own, beside, **settings)
        part.whole, part.places, part.number = self, self.make_ups[number], number
        return part

    @cached_property
    def _lane_of(self) -> np.ndarray:
        """Lane of each unknown in its plane, (pitch,)."""
        return self._lane_of_unknown - self._first[self._lane_of_unknown]

    @cached_property
    def _lane_of_unknown(self) -> np.ndarray:
        """Lane of each unknown, (pitch,)."""
        lane_of, there = np.zeros(self.pitch, dtype=int), self.unknowns >= 0
        lane_of[self.unknowns[there]] = np.flatnonzero(there)
        return lane_of

    @cached_property
    def unknowns(self) -> np.ndarray:
        """Unknown of each lane, -1 in one that has none, shape (n_lanes,)."""
        place = np.arange(self.n_lanes) - self._first
        there = place < np.repeat(self.widths, self._planes)
        result = np.full(self.n_lanes, -1)
        result[there] = np.arange(self.pitch)
        return result

    @cached_property
    def whole_terms(self) -> Terms:
        """Of a block that joins all unknowns of each plane."""
        if self.turns or self.general:
            return self._terms(tuple(range(_power(max(self._planes)))))
        lane, columns = np.arange(self.n_lanes), np.arange(max(self.widths))[:, None]
        sources = self._first + columns
        sources = np.where(sources < self._end, sources, -1)
        return Terms(sources, np.broadcast_to(lane, sources.shape), columns.ravel() % 2)

    @cached_property
    def own_terms(self) -> Terms:
        """Of the diagonal blocks of K and C."""
        return self._terms(self.own)

    @cached_property
    def beside_terms(self) -> Terms:
        """Of the blocks of K and C that join a station to those beside it."""
        if not self.strands:
            return self._terms(self.beside)
        lanes = np.arange(self.n_lanes)
        sources = np.full((max(map(len, self.strands)), self.n_lanes), -1)
        for strand in self.strands:
            own = self._lane_of_unknown[list(strand)]
            sources[: own.size, own] = own[:, None]
        return Terms(sources, np.broadcast_to(lanes, sources.shape), self.sums_of(len(sources)))

    @cached_property
    def halves(self) -> Halves:
        """Of a symmetric block that joins all unknowns of each plane.

        Term d has the unknown that is d places further, round and round in its plane.
        """
        n_terms = max(self.widths) // 2 + 1
        sources = np.full((n_terms, self.n_lanes), -1)
        back = np.tile(np.arange(self.n_lanes), (n_terms, 1))
        mirrored, share = np.zeros(n_terms, dtype=bool), np.ones(sources.shape)
        mirrored[1 : (max(self.widths) + 1) // 2] = True
        for plane, width in enumerate(self.widths):
            own = sum(self._planes[:plane]) + np.arange(width)
            for d in range(width // 2 + 1):
                sources[d, own], back[d, np.roll(own, -d)] = np.roll(own, -d), own
                if 2 * d == width and mirrored[d]:
                    share[d, own] = 0.5
        return Halves(sources, back, mirrored, share)

    def sums_of(self, n_terms: int) -> np.ndarray:
        """Sums (n_terms,) of terms that leave no lanes to be exchanged at the end."""
        return np.zeros(n_terms, dtype=int) if self.turns else np.arange(n_terms) % 2

    def _terms(self, differences: tuple[int, ...]) -> Terms:
        number = np.array(differences, dtype=int)[:, None]
        if self.turns:
            # An odd difference is an even one of sources and a 1 of targets: few are exchanged.
            return Terms(
                self._differing(number & ~1), self._differing(number & 1), number[:, 0] & 1
            )
        sources = self._differing(number)
        targets = np.broadcast_to(np.arange(self.n_lanes), sources.shape)
        return Terms(sources, targets, np.arange(len(differences)) % 2)

    def _differing(self, number: np.ndarray) -> np.ndarray:
        """Lanes of the same plane whose place differs by a number, -1 where there is none."""
        lane = np.arange(self.n_lanes)
        other = self._first + ((lane - self._first) ^ number)
        return np.where(other < self._end, other, -1)

    @cached_property
    def native(self) -> native.Layout:
        """The layout as kernels take it."""
        return native.Layout(
            widths=self.widths,
            own=self.own,
            beside=self.beside,
            damped=self.damped,
            sparse=self.sparse,
            general=self.general,
            strands=self.strands,
        )

    def differences(self, joined: np.ndarray) -> tuple[int, ...]:
        """Numbers of the terms that hold what ``joined`` (b, b) joins, each within a plane."""
        row, column = np.nonzero(joined)
        return tuple(np.unique(self._lane_of[row] ^ self._lane_of[column]).tolist())

    def packed(self, blocks: np.ndarray, terms: Terms) -> np.ndarray:
        """Blocks (..., pitch, pitch) as products read them, shape (..., n); see ``order_of``.

        Those of a part are of the whole.
        """
        return self._packed(blocks, terms.sources, terms.targets, np.ones(terms.sources.shape))

    def packed_inverse(self, blocks: np.ndarray) -> np.ndarray:
        """Symmetric blocks (..., pitch, pitch) as kernels of ``sparse`` factors read S^-1."""
        return self.packed(blocks, self.whole_terms) if self.general else self.packed_halves(blocks)

    def packed_halves(self, blocks: np.ndarray) -> np.ndarray:
        """Symmetric blocks (..., pitch, pitch) as products with ``halves`` read them."""
        sources, _, _, share = self.halves
        lanes = np.broadcast_to(np.arange(self.n_lanes), sources.shape)
        return self._packed(blocks, sources, lanes, share)

    def _packed(
        self, blocks: np.ndarray, sources: np.ndarray, targets: np.ndarray, share: np.ndarray
    ) -> np.ndarray:
        if self.whole is not None:
            blocks = blocks[..., self.places, :][..., self.places]
        row, column = self.unknowns[targets], self.unknowns[sources]
        there = (row >= 0) & (column >= 0) & (sources >= 0)
        numbers = np.where(there, blocks[..., row, column], 0.0) * share
        order = self.order_of(sources)
        result = np.zeros((*blocks.shape[:-2], order.size))
        ranges = ranges_of(self.registers)
        for register, term in np.argwhere(order.begins >= 0).tolist():
            begin, (first, size) = order.begins[register, term], ranges[register]
            result[..., begin : begin + size] = numbers[..., term, first : first + size]
        return result

    def order_of(self, sources: np.ndarray) -> Order:
        """The order of a block of terms with these ``sources``.

        Numbers of a register stand together, those of the largest ones first, and of a register
        without sources in a term none: no load then crosses the end of a line of a cache.
        """
        begins = np.full((len(self.registers), len(sources)), -1)
        end, ranges = 0, ranges_of(self.registers)
        for register in np.argsort(self.registers, kind="stable")[::-1].tolist():
            first, size = ranges[register]
            for term in np.flatnonzero((sources[:, first : first + size] >= 0).any(axis=1)):
                begins[register, term] = end
                end += size
        largest = max(self.registers)
        return Order(begins, -(-end // largest) * largest)


def _power(number: int) -> int:
    """Least power of two that is not less."""
    return 1 << (number - 1).bit_length()


def lanes_of(widths: Sequence[int]) -> list[int]:
    """Lanes of each plane of so many unknowns."""
    return [min(lanes for lanes in LANES if lanes >= width) for width in widths]


def _general_lanes(widths: Sequence[int]) -> list[int]:
    """Lanes of each plane of so many unknowns in a general layout."""
    return [-(-width // _GENERAL) * _GENERAL for width in widths]


def registers_of(widths: Sequence[int]) -> tuple[int, ...]:
    """Lanes of each vector that holds some of those of planes of these ``widths``; those of one
    power of two share vectors, in which they are worked on as one."""
    planes = lanes_of(widths)
    if len(set(planes)) == 1 and planes[0] == _power(planes[0]):
        planes = [sum(planes)]
    sizes = []
    for lanes in planes:
        while lanes:
            sizes.append(min(REGISTER, 1 << (lanes.bit_length() - 1)))
            lanes -= sizes[-1]
    return tuple(sizes)


def ranges_of(registers: tuple[int, ...]) -> list[tuple[int, int]]:
    """First lane and number of lanes of each vector."""
    return list(zip(np.cumsum([0, *registers[:-1]]).tolist(), registers, strict=True))
