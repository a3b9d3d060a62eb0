"""Arrays and compiled functions by their addresses, so that a compiled loop takes any of them.

A loop is compiled anew for each type of argument. Heads of different models, and steps of lines of
different widths, reach a loop as numbers: one machine code, kept between runs, serves them all.
Whoever takes an address keeps what stands there alive.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, typeof, types
from numba.extending import intrinsic

from catenary.solver.base.kernels.bound import bound
from catenary.solver.base.kernels.compiled import called, compiled, compiled_at

_inlined: Any = intrinsic
# Integers that a tuple of arguments takes at most; an array of two dimensions takes nine.
_MOST_HELD = 512
_INDEX = ir.IntType(32)


def address_of(array: np.ndarray) -> int:
    """Where the numbers of an array are, which are to be contiguous doubles."""
    if array.dtype != np.float64 or not array.flags.c_contiguous:
        raise ValueError("a compiled loop needs contiguous doubles")
    return int(array.ctypes.data)


class HeldCall:
    """An ``addressed`` function with its arguments, which a compiled loop calls by ``address``.

    The function takes where its arguments are, and reads them with ``held_at``. The loop's own
    machine code depends on neither. Arrays are kept alive as long as this is.

    Attributes
    ----------
    address : (2,) int, what ``call_held`` takes
    """

    def __init__(self, kernel: Any, arguments: tuple[Any, ...]) -> None:
        self._arguments = arguments
        kind = typeof(arguments)
        function = compiled_at(kernel, types.CPointer(kind))
        self._held = np.zeros(_MOST_HELD, dtype=np.int64)
        if not _hold(_in_numbers(kind, arguments), self._held):
            raise ValueError("too many arguments to be held")
        self.address = function.address, int(self._held.ctypes.data)

    def caller(self) -> Callable[[], None]:
        """A function that calls it once, from Python."""
        return bound(call_once, self.address)


def _in_numbers(kind: Any, value: Any) -> Any:
    """A value with 0 in place of all that its type says: one ``_hold`` serves many types."""
    if isinstance(kind, types.Dummy):
        return 0
    if not isinstance(kind, types.BaseTuple):
        return value
    parts: Any = getattr(kind, "types", ())
    found = [_in_numbers(part, own) for part, own in zip(parts, value, strict=True)]
    return type(value)(*found) if hasattr(value, "_fields") else tuple(found)


@_inlined
def pointer(typing_context, address):
    """An address as a pointer."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.int64), generate


@_inlined
def call(typing_context, address, arguments):
    """Call the compiled function at an address with a tuple of arguments."""

    def generate(context, builder, signature, given):
        place, packed = given
        kinds = signature.args[1].types
        taken = [context.get_value_type(kind) for kind in kinds]
        function = ir.FunctionType(context.get_value_type(types.none), taken)
        values = [builder.extract_value(packed, number) for number in range(len(kinds))]
        builder.call(builder.inttoptr(place, function.as_pointer()), values)
        return context.get_dummy_value()

    return types.void(types.int64, arguments), generate


@_inlined
def borrowed(typing_context, value):
    """An array, or a tuple that holds arrays, of which no references are counted from here on.

    Whoever has given it keeps it alive. Counting takes a tenth of a step of a short line.
    """

    def generate(context, builder, signature, arguments):
        return _borrow(context, builder, signature.return_type, arguments[0])

    return value(value), generate


def _borrow(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """LLVM's value of an array or tuple without owners."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = ir.Constant(array.meminfo.type, None)
        array.parent = ir.Constant(array.parent.type, None)
        return array._getvalue()
    parts: Any = getattr(kind, "types", ())
    if isinstance(kind, types.BaseTuple):
        for number, part in enumerate(parts):
            held = _borrow(context, builder, part, builder.extract_value(value, number))
            value = builder.insert_value(value, held, number)
    return value


@_inlined
def pointed(typing_context, value):
    """A contiguous array, or a tuple that holds such, as where its numbers are in memory.

    Whoever has given it keeps it alive. Loops whose many parts hand it on to each other take half
    the time to compile: an array is seven numbers and a count of references, a pointer is one.
    """

    def generate(context, builder, signature, arguments):
        return _point(context, builder, signature.args[0], arguments[0])

    return _pointed_type(value)(value), generate


def _is_contiguous(kind: Any) -> bool:
    """Whether this is a contiguous array."""
    return isinstance(kind, types.Array) and kind.layout == "C"


def _pointed_type(kind: Any) -> Any:
    """Numba's type of what ``pointed`` makes."""
    if _is_contiguous(kind):
        return types.CPointer(kind.dtype)
    if isinstance(kind, types.BaseTuple):
        parts: Any = getattr(kind, "types", ())
        named = getattr(kind, "instance_class", None)
        return types.BaseTuple.from_types(tuple(map(_pointed_type, parts)), named)
    return kind


def _point(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """LLVM's value of it."""
    if _is_contiguous(kind):
        return context.make_array(kind)(context, builder, value).data
    if isinstance(kind, types.BaseTuple):
        parts: Any = getattr(kind, "types", ())
        places = [
            _point(context, builder, part, builder.extract_value(value, number))
            for number, part in enumerate(parts)
        ]
        return context.make_tuple(builder, _pointed_type(kind), places)
    return value


@_inlined
def _store(typing_context, value, place):
    """Write a tuple to an array of integers as it is in memory; whether there is room."""

    def generate(context, builder, signature, arguments):
        kind, into = signature.args
        pointer = context.make_array(into)(context, builder, arguments[1]).data
        size = context.get_abi_sizeof(context.get_value_type(kind))
        if size > 8 * _MOST_HELD:
            return ir.Constant(ir.IntType(1), 0)
        there = builder.bitcast(pointer, context.get_value_type(kind).as_pointer())
        builder.store(arguments[0], there, align=8)
        return ir.Constant(ir.IntType(1), 1)

    return types.boolean(value, place), generate


@_inlined
def held_at(typing_context, place):
    """The arguments of a ``HeldCall`` that are at a place, without owners."""

    def generate(context, builder, signature, arguments):
        kind = context.get_value_type(signature.return_type)
        return _load_parts(builder, builder.bitcast(arguments[0], kind.as_pointer()), kind)

    return place.dtype(place), generate


def _load_parts(builder: Any, place: Any, kind: Any) -> Any:
    """The value at a place, number by number: of those that nobody uses nothing is left."""
    if not isinstance(kind, (ir.LiteralStructType, ir.ArrayType)):
        return builder.load(place, align=max(1, getattr(kind, "width", 64) // 8))
    value = ir.Constant(kind, ir.Undefined)
    parts = kind.elements if isinstance(kind, ir.LiteralStructType) else [kind.element] * kind.count
    for number, part in enumerate(parts):
        there = builder.gep(place, [_INDEX(0), _INDEX(number)])
        value = builder.insert_value(value, _load_parts(builder, there, part), number)
    return value


@compiled
def _hold(arguments, held):
    return _store(borrowed(arguments), held)


@called
def call_held(address):
    """Call what a ``HeldCall`` holds; ``address`` is its own."""
    call(address[0], (address[1],))


@compiled
def call_once(address):
    """``call_held`` from Python."""
    call_held(address)


@called
def numbers_at(address, n):
    """The array (n,) at an address."""
    return carray(pointer(address), (n,), np.float64)


@called
def table_at_address(address, n, m):
    """The array (n, m) at an address."""
    return carray(pointer(address), (n, m), np.float64)


@called
def cube_at(address, n, m, k):
    """The array (n, m, k) at an address."""
    return carray(pointer(address), (n, m, k), np.float64)
