"""Whether steps of a scene can take on a part of the line only."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.convert.problem import problem_of
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.solver.window.where_possible import why_no_window

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def check_window(scene: Scene) -> Iterator[Fault]:
    """A window with a scheme that has none."""
    if scene.window.mode == "off":
        return
    why = why_no_window(problem_of(scene))
    if why:
        yield refusal(scene.origin, "window.mode", scene.window.mode, f"it must be off, as {why}")
