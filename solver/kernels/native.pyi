"""Kernels of the time loop, compiled from C++: what the extension offers, for type checkers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

class Kernel:
    """A function over arrays and records; arrays are taken as they are, and written in place."""

    def __call__(self, *arguments: Any) -> Any: ...
    def bound(self, *first: Any) -> Bound:
        """The function with its first arguments: a call gives the others."""

class Bound:
    """A kernel with its first arguments, which it keeps alive."""

    def __call__(self, *later: Any) -> Any: ...

RESERVE: np.dtype[np.void]

predict: Kernel
correct: Kernel
displacements: Kernel
velocities: Kernel
reserves: Kernel
energy_of_switching: Kernel

class Layout:
    """How the unknowns of a station stand in lanes; see ``station_layout.Layout``."""

    def __init__(
        self,
        widths: Sequence[int],
        own: Sequence[int],
        beside: Sequence[int],
        damped: bool,
        sparse: bool,
        general: bool,
        strands: Sequence[Sequence[int]],
    ) -> None: ...

class Rows:
    """Rows of a product; see ``StationProduct``. ``places`` has ``starts`` and ``make_up``."""

    def __init__(
        self, kinds: np.ndarray, numbers: np.ndarray, first: int, places: object
    ) -> None: ...

class Factors:
    """Factors; see ``StationFactors``."""

    def __init__(
        self,
        kinds: np.ndarray,
        numbers: np.ndarray,
        beside_kinds: np.ndarray,
        besides: np.ndarray,
        low: int,
        ends: np.ndarray,
        places: object,
    ) -> None: ...

class Products:
    """Products with rows of K, and C, of stations of each make-up."""

    def __init__(
        self, layouts: Sequence[Layout], make_ups: Sequence[Sequence[int]], rows: Rows
    ) -> None: ...
    def multiply(
        self,
        begin: int,
        end: int,
        factor: np.ndarray,
        velocity: np.ndarray,
        result: np.ndarray,
    ) -> None:
        """Fill in the rows from ``begin`` to ``end`` of ``result``."""

class Solves:
    """Solves with factors of stations of each make-up."""

    def __init__(
        self, layouts: Sequence[Layout], make_ups: Sequence[Sequence[int]], factors: Factors
    ) -> None: ...
    def solve(self, right: np.ndarray, answer: np.ndarray) -> None:
        """Fill ``answer``, which may be ``right``."""

class Passes:
    """Steps in two passes; see ``StationPasses``. Arrays are kept, and read and written in place:
    what products read of displacements and of velocities, loads, accelerations, x, y and z of the
    motion, and its known acceleration."""

    def __init__(
        self,
        layouts: Sequence[tuple[Layout, Layout]],
        make_ups: Sequence[Sequence[int]],
        rows: Rows,
        factors: Factors,
        arrays: Sequence[np.ndarray],
        changes: Sequence[float],
    ) -> None: ...
    def call(self, stretch: int, ahead: tuple[int, int], following: tuple[int, int]) -> None:
        """Call what is at these addresses before a step, and after each stretch of its pass back;
        none if they are zero."""

    def step(self) -> None:
        """Take a step."""

    @property
    def address(self) -> tuple[int, int]:
        """What a compiled loop calls to take a step, and with what."""

def has_widths(widths: Sequence[int]) -> bool:
    """Whether kernels were compiled for stations with planes of these widths."""

def has_strands(factors: Layout) -> bool:
    """Whether kernels were compiled for factors with these strands."""

def targets() -> list[str]:
    """Processors that kernels were compiled for and that this one can be, the best last."""

def set_target(name: str) -> bool:
    """Let what is made from now on use the kernels of one of these; whether there is such a one."""
