"""LLVM's vectors that hold the lanes of a station, for the intrinsics that work with lanes."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir

from catenary.solver.linear.stations.station_layout import ranges_of


class Registers:
    """LLVM's vectors that arithmetic on lanes is done with.

    Between operations several are a struct. Nothing calls with it, or returns it, that is not put
    in the place of the call, so that none is kept in memory.
    """

    def __init__(self, sizes: tuple[int, ...]) -> None:
        vectors = [vector_type(size) for size in sizes]
        self._sizes = sizes
        self.type = vectors[0] if len(sizes) == 1 else ir.LiteralStructType(vectors)

    def zeros(self) -> Any:
        """0 in all lanes."""
        return self.all_of(0.0)

    def all_of(self, number: float) -> Any:
        """A number in all lanes."""
        vectors = [ir.Constant(vector_type(size), [number] * size) for size in self._sizes]
        return vectors[0] if len(vectors) == 1 else ir.Constant(self.type, vectors)

    def together(self, builder: Any, vectors: list[Any]) -> Any:
        """Lanes from the vectors that hold them."""
        if len(vectors) == 1:
            return vectors[0]
        result = ir.Constant(self.type, ir.Undefined)
        for number, vector in enumerate(vectors):
            result = builder.insert_value(result, vector, number)
        return result

    def apart(self, builder: Any, lanes: Any) -> list[Any]:
        """Vectors that hold the lanes."""
        if len(self._sizes) == 1:
            return [lanes]
        return [builder.extract_value(lanes, number) for number in range(len(self._sizes))]

    def each(self, builder: Any, function: Any, *lanes: Any) -> Any:
        """A function of vectors for all lanes."""
        parts = zip(*(self.apart(builder, one) for one in lanes), strict=True)
        return self.together(builder, [function(*part) for part in parts])


def gathered(builder: Any, vectors: list[Any], lanes: np.ndarray) -> Any:
    """Numbers by their lanes in ``vectors``, which follow each other."""
    ends = np.cumsum([vector.type.count for vector in vectors])
    source = np.searchsorted(ends, lanes, side="right")
    places = lanes - np.concatenate([[0], ends])[source]
    numbers = np.unique(source).tolist()
    one = vectors[numbers[0]]
    if len(numbers) == 1:
        if np.array_equal(places, np.arange(one.type.count)):
            return one
        return spread(builder, one, places.tolist())
    chosen = places
    for number in numbers[1:]:
        other = vectors[number]
        size = max(one.type.count, other.type.count)
        chosen = np.where(source == number, places + size, chosen)
        one = shuffled(
            builder,
            _widened(builder, one, size),
            _widened(builder, other, size),
            np.where(source <= number, chosen, 0).tolist(),
        )
        chosen = np.arange(lanes.size)
    return one


def vector_type(size: int) -> ir.VectorType:
    """LLVM's type of so many numbers."""
    return ir.VectorType(ir.DoubleType(), size)


def zeros(size: int) -> ir.Constant:
    """As many zeros."""
    return ir.Constant(vector_type(size), [0.0] * size)


def spread(builder: Any, x: Any, lanes: list[int]) -> Any:
    """Numbers of x by their lanes."""
    return shuffled(builder, x, ir.Constant(x.type, ir.Undefined), lanes)


def chosen(
    builder: Any, given: tuple[int, ...], x: Any, wanted: tuple[int, ...], lanes: np.ndarray
) -> Any:
    """Numbers of x, in ``given`` registers, by their lanes in ``wanted`` ones, 0 for -1."""
    vectors = [*Registers(given).apart(builder, x), zeros(max(wanted))]
    lanes = np.where(lanes < 0, sum(given), lanes)
    found = [gathered(builder, vectors, lanes[a : a + size]) for a, size in ranges_of(wanted)]
    return Registers(wanted).together(builder, found)


def _widened(builder: Any, x: Any, size: int) -> Any:
    """x with lanes that are not defined at its end."""
    if x.type.count == size:
        return x
    # The first lane after those of x is of what is not defined.
    return spread(builder, x, [min(lane, x.type.count) for lane in range(size)])


def shuffled(builder: Any, x: Any, y: Any, lanes: list[int]) -> Any:
    """Numbers of x, and of y behind these, by their lanes."""
    mask = ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), lanes)
    return builder.shuffle_vector(x, y, mask)
