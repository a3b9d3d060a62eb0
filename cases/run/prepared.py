"""Lines of scenes at rest, and lines prepared for steps from outside."""

from __future__ import annotations

from math import inf
from pathlib import Path

import catenary.solver.kernels
from catenary.base.mpi import MPI
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.scene import Scene, problem_of
from catenary.solver.effects.effect import Limit
from catenary.solver.problem.problem import slowest_wave_speed
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest, refuse_lost_wire
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.prepared_line import write_line

_KERNELS = Path(catenary.solver.kernels.__path__[0])
# Header and library of C programs.
HEADER, LIBRARY = _KERNELS / "simulation/catenary.h", _KERNELS / "libcatenary.so"


def rest_of(scene: Scene) -> LineAtRest:
    """The line of a scene at rest. Not collective."""
    return line_at_rest(problem_of(scene), mesh_of(scene))


def sound_rest(scene: Scene) -> LineAtRest:
    """The line of a scene at rest; InputError if a wire has lost its tension. Not collective."""
    found = rest_of(scene)
    refuse_lost_wire(found.model, found.form)
    return found


def prepare_line(scene: Scene, path: Path) -> int:
    """Write the line of a scene with its train at rest; for how many steps. Not collective.

    Raises
    ------
    InputError
        If the line is impossible, or its steps need what a prepared line has not.
    RunBroken
        If the file cannot be written.
    """
    at_rest = sound_rest(scene)
    slower = scene.holds(Limit.WAVE_SPEED)
    below = slowest_wave_speed(at_rest.problem) if slower else inf
    with March(MPI.COMM_SELF, *at_rest) as march:
        return write_line(march, path, below)
