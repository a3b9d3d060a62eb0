"""Changes to modules of the program, made when it imports them and not before."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any


class _Finder:
    def __init__(self, name: str, change: Callable[[ModuleType], None]) -> None:
        self._name, self._change = name, change

    def find_spec(self, name: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if name != self._name:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        assert spec is not None and spec.loader is not None
        load = spec.loader.exec_module

        def exec_module(module: ModuleType) -> None:
            load(module)
            self._change(module)

        setattr(spec.loader, "exec_module", exec_module)  # noqa: B010
        return spec


def on_import(name: str, change: Callable[[ModuleType], None]) -> None:
    """Call ``change`` with a module as soon as it is imported, which it must not be yet."""
    assert name not in sys.modules
    sys.meta_path.insert(0, _Finder(name, change))
