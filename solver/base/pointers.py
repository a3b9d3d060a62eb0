"""Arrays and compiled functions by their addresses, so that a compiled loop takes any of them.

A loop is compiled anew for each type of argument. Heads of different models, and steps of lines of
different widths, reach a loop as numbers: one machine code, kept between runs, serves them all.
Whoever takes an address keeps what stands there alive.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import carray, typeof, types
from numba.extending import intrinsic

from catenary.solver.base.compiled import compiled

_inlined: Any = intrinsic


def address_of(array: np.ndarray) -> int:
    """Where the numbers of an array are, which are to be contiguous doubles."""
    if array.dtype != np.float64 or not array.flags.c_contiguous:
        raise ValueError("a compiled loop needs contiguous doubles")
    return int(array.ctypes.data)


def address_of_function(kernel: Any, arguments: tuple[Any, ...]) -> int:
    """Where the machine code of a compiled function is, for arguments like these; for ``call``."""
    kinds = tuple(typeof(argument) for argument in arguments)
    kernel.compile(kinds)
    kind = types.FunctionType(types.none(*kinds))
    _own_address.compile((kind,))
    return int(_own_address.overloads[(kind,)].entry_point(kernel))


@_inlined
def pointer(typing_context, address):
    """An address as a pointer."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.int64), generate


@_inlined
def call(typing_context, address, arguments):
    """Call the compiled function at an ``address_of_function`` with a tuple of arguments."""

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
def _address_in(typing_context, function):
    """The address that a compiled function is called at."""

    def generate(context, builder, signature, arguments):
        return builder.ptrtoint(builder.extract_value(arguments[0], 0), ir.IntType(64))

    return types.int64(function), generate


@compiled
def _own_address(function):
    return _address_in(function)


@compiled
def numbers_at(address, n):
    """The array (n,) at an address."""
    return carray(pointer(address), (n,), np.float64)


@compiled
def table_at_address(address, n, m):
    """The array (n, m) at an address."""
    return carray(pointer(address), (n, m), np.float64)


@compiled
def cube_at(address, n, m, k):
    """The array (n, m, k) at an address."""
    return carray(pointer(address), (n, m, k), np.float64)
