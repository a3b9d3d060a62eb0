"""Kernels refuse arrays that do not fit each other, in a sentence, before they touch them.

In a usual build they check no index: a shorter array would be read beyond its end.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from repeating_line import layout, line, station_factors, station_product

from catenary.mbs.interface import affine
from catenary.solver.contact.forces_on_line import no_links
from catenary.solver.contact_problem.coupling import InnerProblem
from catenary.solver.contact_problem.force_exchange import LineResponse
from catenary.solver.contact_problem.law_tangents import LawInSteps
from catenary.solver.kernels import native

N, S, K = 3, 2, 4


def small_problem() -> object:
    """A small problem of two contacts without links, as kernels solve it."""
    heads, response = affine(np.zeros(12), 2), LineResponse(2, 0)
    inner = InnerProblem(LawInSteps(2, 5e4, 0.0, pulls=False), no_links())
    problem, rows = inner.problem(heads, response), SimpleNamespace(numbers=response.rows.numbers)
    return problem._replace(share=SimpleNamespace(**response.arrays._asdict() | {"rows": rows}))


def system(m: int) -> tuple[object, ...]:
    """A system of m unknowns, their signs, a bound of rounds, room."""
    made = SimpleNamespace(matrix=np.eye(m), right=np.ones(m), solution=np.zeros(m))
    signs = SimpleNamespace(always=np.zeros(m, dtype=bool), behind=np.zeros(m, dtype=np.int64))
    return made, signs, 9, native.Room(m)


# Calls in which no array may be shorter, along any axis, than it is.
CALLS = {
    "spline_at": (np.arange(N + 1.0), np.zeros((N, 4)), 0.5),
    "sines_at": (*np.zeros((3, N)), 0.5),
    "polyline_at": (*np.zeros((2, N)), *np.zeros((3, S))),
    "correct": (*np.zeros((3, N)), 0.0, 0.0, 0.0),
    "add_waves": (np.zeros((S, K)), np.zeros((K, N)), np.zeros((S, N))),
    "rotation_matrices": (np.zeros((N, 4)), np.zeros((N, 3, 3))),
    "move_bodies": (np.zeros((N + 1, 3)), np.ones((N + 1, 4)), np.zeros(6 * N)),
    "add_gyroscopic_moments": (np.zeros(6 * N), np.zeros((N, 3)), np.zeros((N + 1, 3))),
    "find_solution": system(N),
    "solve": (small_problem(), None),
}


def arrays_in(given: object, way: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Ways to all arrays in the arguments of a call."""
    if isinstance(given, np.ndarray):
        if given.size:
            yield way
    elif hasattr(given, "__dict__") or hasattr(given, "_fields"):
        for name in getattr(given, "_fields", None) or vars(given):
            yield from arrays_in(getattr(given, name), (*way, name))


def changed(given: object, way: tuple[str | int, ...], axis: int) -> object:
    """The same with the array at the end of a way shorter by one along an axis."""
    if not way:
        assert isinstance(given, np.ndarray)
        return np.ascontiguousarray(np.delete(given, -1, axis))
    names = getattr(given, "_fields", None) or vars(given)
    members = {name: getattr(given, name) for name in names}
    members[str(way[0])] = changed(members[str(way[0])], way[1:], axis)
    return SimpleNamespace(**members)


@pytest.mark.parametrize("name", CALLS)
def test_shorter_arrays_are_refused(name: str) -> None:
    kernel, given = getattr(native, name), CALLS[name]
    kernel(*given)
    number = 0
    for i, argument in enumerate(given):
        for way in arrays_in(argument):
            array = argument
            for step in way:
                array = getattr(array, str(step))
            assert isinstance(array, np.ndarray)
            for axis in np.flatnonzero(array.shape):
                own = list(given)
                own[i] = changed(argument, way, int(axis))
                with pytest.raises(ValueError, match=f"argument . of {name}.* has .*, not "):
                    kernel(*own)
                number += 1
    assert number >= 2


def test_a_refusal_names_the_array_and_the_sizes() -> None:
    short = np.zeros((K - 1, N))
    with pytest.raises(ValueError) as refused:
        native.add_waves(np.zeros((S, K)), short, np.zeros((S, N)))
    known = "with s = 2, k = 4"
    assert str(refused.value) == f"argument 2 of add_waves has the shape (3 3), not (k m), {known}"
    with pytest.raises(ValueError, match=re.escape("has the shape (0), not (n>0)")):
        native.polyline_at(*np.zeros((2, 0)), *np.zeros((3, S)))


def test_lengths_of_transforms_are_checked() -> None:
    with pytest.raises(ValueError, match="a power of two numbers"):
        native.fourier_forth(*np.zeros((2, 3), dtype=complex))


def test_a_line_refuses_vectors_that_are_shorter_than_its_stations() -> None:
    matrix, n = line(5), 4 * 5
    product, factors = (
        station_product(matrix, 0, layout(matrix)),
        station_factors(matrix, layout(matrix)),
    )
    assert product is not None and factors is not None
    read, result = np.zeros(n + 8), np.zeros(n)
    product.multiply(read, result)
    factors.solve(result, result)
    for few in ((read[:-1], result), (read, result[:-1])):
        with pytest.raises(ValueError, match="too few numbers"):
            product.multiply(*few)
    for few in ((result[:-1], result), (result, result[:-1])):
        with pytest.raises(ValueError, match="too few numbers"):
            factors.solve(*few)


def test_a_line_refuses_blocks_that_are_shorter_than_its_rows() -> None:
    matrix = line(5)
    product = station_product(matrix, 0, layout(matrix))
    factors = station_factors(matrix, layout(matrix))
    assert product is not None and factors is not None
    product.arrays = product.arrays._replace(blocks=product.arrays.blocks[:-1])
    with pytest.raises(ValueError, match="more numbers than their blocks"):
        product.multiply(np.zeros(28), np.zeros(20))
    factors.arrays = factors.arrays._replace(besides=factors.arrays.besides[:-1])
    with pytest.raises(ValueError, match="more numbers than their blocks"):
        factors.solve(*np.zeros((2, 20)))
