"""Imported before the program: its pictures are drawn on panels that were there before, without
labels and legends, and not painted: both take long."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from on_import import on_import
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


def _leave_unpainted(module: ModuleType) -> None:
    for name, painter in PAINTERS.items():
        assert callable(getattr(module, name))
        setattr(module, name, painter)
    blank = _blank_panels()
    for name in ("stacked", "tidy", "legend_above"):
        assert callable(getattr(module, name))
        setattr(module, name, getattr(blank, name, blank.nothing))


on_import(FIGURES, _leave_unpainted)
