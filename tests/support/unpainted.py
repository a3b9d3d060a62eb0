"""Imported before the program: its pictures are laid out, but not painted, which takes long."""

from __future__ import annotations

import base64
import importlib.util
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

PAINTER = "catenary.postproc.report.pictures.figures"
# A PNG file of one pixel.
PIXEL = base64.b64decode(
    b"iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg=="
)


class _Finder:
    """Changes the painter when the program imports it, and does not import it before."""

    def find_spec(self, name: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if name != PAINTER:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        assert spec is not None and spec.loader is not None
        load = spec.loader.exec_module

        def exec_module(module: ModuleType) -> None:
            load(module)
            assert callable(module.png)
            setattr(module, "png", lambda figure: PIXEL)  # noqa: B010

        setattr(spec.loader, "exec_module", exec_module)  # noqa: B010
        return spec


sys.meta_path.insert(0, _Finder())
