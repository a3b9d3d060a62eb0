"""What an axis of ``catenary accuracy`` is: levels, and what they are compared with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

DISCRETISATION, MODEL = "discretisation", "model"


@dataclass(frozen=True)
class Level:
    """One setting of an axis.

    Attributes
    ----------
    name : short, unique within its axis
    assignments : ``key=value`` each, on top of the scene
    sizes : what is refined, by name: ``dt`` [s], ``h`` as a share of a gap; empty if nothing is
    quick : whether the level also belongs to the short form of the axis
    """

    name: str
    assignments: tuple[str, ...]
    sizes: tuple[tuple[str, float], ...] = ()
    quick: bool = False

    def size(self, name: str) -> float | None:
        """The value of one of ``sizes``, None if it has none."""
        return dict(self.sizes).get(name)


@dataclass(frozen=True)
class Reference:
    """What the levels of a discretisation axis are compared with, and what it is measured by.

    Attributes
    ----------
    level : finer than every level of the axis in all that it refines
    chains : for each size three levels, of which each has half the fineness of the one before it;
        the first is the reference, or has its fineness in that size
    """

    level: Level
    chains: tuple[tuple[Level, Level, Level], ...]


@dataclass(frozen=True)
class Axis:
    """One thing that is varied.

    Attributes
    ----------
    name, title : for the option ``--axes`` and for headings
    kind : ``DISCRETISATION`` or ``MODEL``
    levels : the levels for a scene, quick ones only on request; none where it has nothing to vary
    reference : for a scene, the reference of a discretisation axis; None for models, which are
        compared with the scene as it is
    refined : which of the levels' sizes an observed order belongs to, "" if none
    step_alone : for a level of step and mesh, the one with its mesh and the reference's step: what
        the two differ by is the error of the step, what is left that of the mesh; None if the axis
        does not refine both
    """

    name: str
    title: str
    kind: str
    levels: Callable[[Scene], Sequence[Level]]
    reference: Callable[[bool], Reference] | None = None
    refined: str = ""
    step_alone: Callable[[Level], Level] | None = None

    def chosen(self, scene: Scene, quick: bool) -> list[Level]:
        """The levels of the axis for a scene, in the long or the short form."""
        return [level for level in self.levels(scene) if level.quick or not quick]
