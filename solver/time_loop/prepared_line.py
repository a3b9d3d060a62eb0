"""A line that is prepared for steps from outside: a file that needs neither Python nor PETSc.

`native.Simulation`, and the library of `kernels/simulation/catenary.h`, read it.
"""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.base.files import appears_whole
from catenary.base.options import option
from catenary.mbs.head.pantograph import Pantograph, SteppedHead
from catenary.mbs.interface import N_DRIVE, drive_width
from catenary.solver.contact_problem.coupling import Implicit
from catenary.solver.kernels import native
from catenary.solver.model.beam import MOST_ROTATION
from catenary.solver.schemes.scheme import OneSolve
from catenary.solver.time_loop.compiled_steps import CompiledSteps
from catenary.solver.time_loop.march import March

# Links of a long line that may switch in one step: mostly it is some ten. These take 7 MB.
_MOST_LINKS = 512

# Time in which all rotations of wires are looked at once [s], as a run does.
_LOOKS = 1.0


def write_line(march: March, path: Path, most_speed: float) -> int:
    """Write a line as it is now, with what steps to come depend on; for how many of these. Not
    collective; one rank only.

    Parameters
    ----------
    march : March
        Line with its train.
    path : Path
        File to be written.
    most_speed : float
        Speed of the slowest wave, below which the train can be given any speed, or infinite [m/s].

    Raises
    ------
    InputError
        If steps of the scene need more than the compiled loop, loads are made while they are
        stepped, or only a part of the line is there.
    RunBroken
        If the file cannot be written.
    """
    scheme, showing, dt = march.in_loop()
    line, pantographs = scheme.interaction.line, scheme.pantographs
    if line.loads is not None and line.loads.are_sampled:
        raise InputError(
            "gusts are made under way, and a prepared line has none: take them away "
            f"({option('wind.gusts=', 'wind.gusts = None in replace()')})"
        )
    if line.window is not None and not line.window.has_rows(0, line.window.arrays.low.size):
        raise InputError(
            "a window has the matrices of its own part of the line, and a prepared line has all: "
            'take window.mode = "off"'
        )
    make_room(scheme)
    first, last = march.first_step, march.n_steps
    numbering = line.windows.numbering
    turns = numbering.numbers[:, [name.startswith("theta") for name in numbering.names]]
    models = [stepped_by_kernels(model) for model in pantographs.models]
    drives = np.zeros((last - first, len(models), drive_width(pantographs.most_contacts)))
    pantographs.fill_drives(np.arange(first + 1, last + 1) * dt, drives)
    end = float(scheme.interaction.contacts.wires.nodes["x"].max())
    ahead = native.Ahead(
        dt,
        first,
        drives,
        ties=np.array([model.tie for model in models], dtype=native.TIE),
        one_speed=pantographs.along_track or bool(drives[..., N_DRIVE:].any()),
        most_speed=most_speed,
        longest_way=end - float(pantographs.places_along.start.max()),
        turns=turns[turns >= 0].astype(np.int64),
        most_turn=MOST_ROTATION,
        look_steps=max(1, round(_LOOKS / dt)),
    )
    pantographs.move_to(first * dt)
    # An earlier file stays until this one is whole. A device takes what is written as it comes.
    is_device = path.exists() and not path.is_file()
    try:
        with nullcontext(path) if is_device else appears_whole(path) as made_as:
            CompiledSteps(scheme, showing, dt, shows=False).steps().write(str(made_as), ahead)
    except (OSError, RuntimeError) as error:
        raise RunBroken(f"{path}: {error}: free some space or choose another file") from error
    return last - first


def make_room(scheme: OneSolve) -> None:
    """Make room for all links that may have a row in a step to come: steps can make no more."""
    assert isinstance(scheme.coupling, Implicit)
    n_links = min(scheme.coupling.inner.coupled.released.size, _MOST_LINKS)
    scheme.make_room(n_links)
    scheme.coupling.inner.make_room(n_links)


def stepped_by_kernels(model: Pantograph) -> SteppedHead:
    """Data of a pantograph that kernels step.

    Raises
    ------
    InputError
        If they call Python for it.
    """
    if not isinstance(model, SteppedHead):
        raise InputError(
            "a pantograph has all its bodies in the time loop, which Python steps: take "
            'pantographs.*.motion = "reduced"'
        )
    if model.by_hand:
        raise InputError("a pantograph has a controller in Python")
    return model
