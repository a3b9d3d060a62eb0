"""Overhead lines under pantographs, from Python: scenes, runs, steps, results.

``docs/python.md`` shows all of it. Names are loaded when they are first used: what a program does
not use costs it nothing. Nothing is printed and nothing shown unless it is asked for; the logger
is called ``catenary``.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

if __name__ != "catenary":
    raise ImportError(
        f"import catenary, not {__name__}: the folder is installed as catenary, "
        "and a second copy under another name would hold its own state"
    )

if TYPE_CHECKING:
    from catenary.base.errors import CatenaryError, Fault, InputError, RunBroken
    from catenary.line_tables import AtRest, Checked, Plan, check, plan, static
    from catenary.optimising import Optimum, optimise, tolerance
    from catenary.parameters import Identified, identify, sensitivity
    from catenary.questions import highest_speeds, separations
    from catenary.results import Pictures, Run, open
    from catenary.runs import restart, run
    from catenary.scenes import Scene, load, shipped_cases
    from catenary.steps import Simulation, prepare
    from catenary.sweeps import Uncertainty, sweep, uncertainty

__all__ = [
    "AtRest", "CatenaryError", "Checked", "Fault", "Identified", "InputError", "Optimum",
    "Pictures", "Plan", "Run", "RunBroken", "Scene", "Simulation", "Uncertainty", "__version__",
    "check", "highest_speeds", "identify", "load", "open", "optimise", "plan", "prepare", "restart",
    "run", "sensitivity", "separations", "shipped_cases", "static", "sweep", "tolerance",
    "uncertainty",
]  # fmt: skip

_FILES = {
    "sweeps": ("Uncertainty", "sweep", "uncertainty"),
    "parameters": ("Identified", "identify", "sensitivity"),
    "line_tables": ("AtRest", "Checked", "Plan", "check", "plan", "static"),
    "optimising": ("Optimum", "optimise", "tolerance"),
    "results": ("Pictures", "Run", "open"),
    "questions": ("highest_speeds", "separations"),
    "runs": ("restart", "run"),
    "scenes": ("Scene", "load", "shipped_cases"),
    "base.errors": ("CatenaryError", "Fault", "InputError", "RunBroken"),
    "steps": ("Simulation", "prepare"),
}
_FILE_OF = {name: file for file, names in _FILES.items() for name in names}

# A program that sets up no logging gets no messages; one that does gets those of its level.
logging.getLogger(__name__).addHandler(logging.NullHandler())


def __getattr__(name: str) -> Any:
    """A public name, whose file is loaded when it is asked for."""
    value: Any
    if name == "__version__":
        from importlib.metadata import version

        value = version("catenary")
    elif name in _FILE_OF:
        from importlib import import_module

        value = getattr(import_module(f"catenary.{_FILE_OF[name]}"), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
