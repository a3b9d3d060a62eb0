"""What mypy is to know of the compiled kernels: the stub ``native.pyi``, made of the extension.

Functions over arrays and records, records and types of numbers are told by their names; of classes
and other functions pybind11 keeps the signatures. The stub of mypy's own `stubgen` has 1300 lines,
and mypy finds 133 errors with it: results are `object`, and records classes without their members.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np

from catenary.solver.kernels import native

HEAD = [
    "# Made by `make mypy`, of the extension that is there.",
    "import collections.abc, typing, numpy, numpy.typing",
]


def signature(text: str | None) -> str:
    """A signature as pybind11 writes it, without the names of C++."""
    first = (text or "").partition("\n")[0].replace(f"{native.__name__}.", "")
    named = re.sub(r"catenary::\w+|(?<=-> )object", "typing.Any", first)
    return named.replace("*args", "*args: typing.Any")


def lines_of_class(name: str, own: type) -> Iterator[str]:
    """A class with its methods and properties."""
    base = own.__mro__[1].__name__
    yield f"class {name}({base}):" if hasattr(native, base) else f"class {name}:"
    for key, value in vars(own).items():
        if isinstance(value, property):
            kind = signature(value.fget.__doc__).partition(" -> ")[2]
            read = f"    @property\n    def {key}(self) -> {kind}: ..."
            yield f"    {key}: {kind}" if value.fset else read
        elif "(self: " in (value.__doc__ or ""):
            yield f"    def {signature(value.__doc__)}: ..."
    yield "    ..."


def lines_of(name: str, own: object) -> Iterator[str]:
    """What the extension offers by a name."""
    if isinstance(own, type) and hasattr(own, "_fields"):
        yield f'{name} = collections.namedtuple("{name}", "{" ".join(own._fields)}")'
    elif isinstance(own, type):
        yield from lines_of_class(name, own)
    elif isinstance(own, np.dtype):
        yield f"{name}: numpy.dtype[numpy.void]"
    elif isinstance(own, native.Kernel | int | float):
        yield f"{name}: {type(own).__name__}"
    else:
        yield f"def {signature(own.__doc__)}: ..."


def stub(module: ModuleType) -> str:
    """The stub of an extension."""
    names = (name for name in vars(module) if not name.startswith("_"))
    lines = (line for name in names for line in lines_of(name, vars(module)[name]))
    return "\n".join([*HEAD, *lines, ""])


def main() -> None:
    """Write the stub beside the package's sources; one that is right stays, for mypy's cache."""
    path = Path("solver/kernels/native.pyi")
    if not path.exists() or path.read_text(encoding="utf-8") != stub(native):
        path.write_text(stub(native), encoding="utf-8")


main()
