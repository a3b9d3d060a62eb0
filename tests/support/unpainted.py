"""Imported before the program: its pictures are drawn on panels that were there before, without
labels and legends, and not painted: both take long."""

from __future__ import annotations

import importlib.util
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

from pixels import FIGURES, PAINTERS


def _blank_panels() -> Any:
    """The module, imported when pictures are; this folder is not among the program's by then."""
    name = "blank_panels"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
        assert spec is not None and spec.loader is not None
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


class _Finder:
    """Changes the painter when the program imports it, and does not import it before."""

    def find_spec(self, name: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if name != FIGURES:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        assert spec is not None and spec.loader is not None
        load = spec.loader.exec_module

        def exec_module(module: ModuleType) -> None:
            load(module)
            for name, painter in PAINTERS.items():
                assert callable(getattr(module, name))
                setattr(module, name, painter)
            blank = _blank_panels()
            for name in ("stacked", "tidy", "legend_above"):
                assert callable(getattr(module, name))
                setattr(module, name, getattr(blank, name, blank.nothing))

        setattr(spec.loader, "exec_module", exec_module)  # noqa: B010
        return spec


sys.meta_path.insert(0, _Finder())
