"""Runs that go on: from a valid state of the same line, train and method, and beyond their end."""

from __future__ import annotations

import contextlib
import copy
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from h5py import h5f

from catenary.base.errors import InputError
from catenary.base.files import is_there
from catenary.base.options import option
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.load import scene_from
from catenary.cases.scene.scene import Scene, resolved
from catenary.postproc.files.committed_rows import fault_to_continue
from catenary.postproc.files.hdf5 import open_own
from catenary.postproc.files.header import Header
from catenary.postproc.files.own_files import FIELD_FILES
from catenary.postproc.read.guard import survives
from catenary.postproc.read.results import Results
from catenary.solver.model.model import Model
from catenary.solver.time_loop.views.channels import CHANNELS

# Attributes that a restart must find again; the rest of the head may be another version's.
_SAME = ("case", "n_dofs", "system")
_SAME_FACTS = ("time_step", "speed", "wave_speed")
# Values that a state and the records of its step share, copied from the same arrays; so far apart
# they may be, as a share of the largest or of 1 m or 1 N.
_RECORDED = ("contact_force", "head_height", "wire_height", "strip_force", "contact_wire_force")
_ROUNDING = 1e-9
# Another machine's rounding at rest, as a share and as a size [m], [N].
_RELATIVE, _ABSOLUTE = 1e-6, 1e-6


UNTIL, EVALUATE = ("--until-m", "until_m"), ("--evaluate", "evaluate")


def state_to_continue(result: Path, beyond_end: bool = False) -> dict[str, Any]:
    """The latest valid state of an unfinished run. Not collective.

    ``beyond_end`` is whether it may have come to its end.

    Raises
    ------
    InputError
        If there is no result file, if it is done, too damaged, or still read by this process.
    """
    if not is_there(result):
        raise InputError(
            f"there is no {result} to continue; start the case with "
            f"{option('`catenary run`', 'catenary.run()')}"
        )
    # Refused before anything is written.
    fields = result.with_name(FIELD_FILES[0])
    if os.path.lexists(fields) and survives(fields):
        with contextlib.suppress(OSError, RuntimeError):  # damaged, and begun anew
            open_own(fields, locking=False).close()
    with Results(result) as results:
        if results.complete and not beyond_end:
            raise InputError(
                f"the run in {result} is done; there is nothing to continue, unless "
                f"{option(*UNTIL)} says where it is to end"
            )
        excitation = results.attributes.get("excitation")
        if excitation:
            raise _refusal(result, f"{excitation['says']} excites its line, not a train")
        state = results.checkpoint
        half_before = (state["step"] - 0.5) * results.dt
    # A table that is written to may be damaged where the report does not read it.
    fault = "HDF5 cannot open all of it"
    if survives(result):
        fault = fault_to_continue(result, half_before)
    if fault:
        raise _refusal(result, f"{fault}; what is valid can be reported")
    if not beyond_end:  # the file goes on in its place
        _refuse_open(result)
    return state


def _refuse_open(file: Path) -> None:
    """Raise InputError if this process reads a file, to which HDF5 then does not write."""

    names = [os.fsdecode(h5f.get_name(one)) for one in h5f.get_obj_ids(types=h5f.OBJ_FILE)]
    there = filter(os.path.exists, names) if is_there(file) else ()
    if any(os.path.samefile(name, file) for name in there):
        raise InputError(
            f"{file} is open in this program: close() the run that reads it, then continue it"
        )


def refuse_other_scene(result: Path, scene: Scene) -> None:
    """Raise InputError if there is a result file that is done or another scene's. Not collective.

    For jobs, which continue what they find in their folder.
    """
    if not is_there(result):
        return
    with Results(result) as results:
        config, complete = results.attributes["config"], results.complete
    if complete:
        raise InputError(f"the run in {result} is done; name another folder with -o")
    if resolved(extended_scene(config, str(result), None, None)) != resolved(scene):
        raise InputError(
            f"{result} holds the beginning of another scene's run, which a job would continue; "
            "name another folder with -o, or remove that file"
        )


def refuse_other_run(
    result: Path, header: Header, n_strips: tuple[int, ...], may_change: tuple[str, ...] = ()
) -> None:
    """Raise InputError unless a result file is of the run that its scene makes. Not collective.

    Parameters
    ----------
    header : of the scene in the file, made anew
    n_strips : strips of each pantograph
    may_change : datasets that may be others
    """
    with Results(result) as results:
        about = results.attributes
        pairs = {name: (about[name], header.attributes[name]) for name in _SAME}
        pairs |= {n: (results.fact(n), float(header.facts[n])) for n in _SAME_FACTS}
        for name, (found, value) in pairs.items():
            if not _same(found, value):
                raise _refusal(result, f"{name} is {found}, its scene makes {value}")
        if results.n_strips() != list(n_strips):
            raise _refusal(result, f"its pantographs have {results.n_strips()} strips")
        datasets = {k: v for k, v in header.datasets.items() if k not in may_change}
        _refuse_other_line(result, results, datasets)


def refuse_other_state(result: Path, state: Mapping[str, Any], model: Model) -> None:
    """Raise InputError unless a state agrees with the records of its step. Not collective.

    Compared are contact forces, heights, and the uplift of the line at its steady arms, as far as
    the file records them at that step. Arrays of another size pass: the march refuses them.

    Parameters
    ----------
    result : the result file
    state : state to continue from; its arrays of the line have a row for each node along the track
    model : model of the line in the file
    """
    step = state["step"]
    with Results(result) as results:
        if step >= results.n_rows("time"):
            return
        pairs = {
            name: (np.ravel(state[name]), results.rows(name, slice(step, step + 1))[0])
            for name in _RECORDED
            if np.asarray(state.get(name)).dtype.kind in "fiu" and results.has(name)
        }
        apart = np.abs(results.line_time - results.time_at(step))
        moved, shape = (
            np.asarray(state.get("displacement")),
            (model.mesh.n_nodes, len(model.unknowns)),
        )
        # The line's channels may be recorded at some steps alone.
        if apart.size and apart.min() < 0.5 * results.dt and moved.size == np.prod(shape):
            row = int(apart.argmin())
            at_arms = moved.reshape(shape)[model.row_of_node[model.mesh.steady_arms]]
            recorded = results.rows("arm_uplift", slice(row, row + 1))[0]
            pairs["arm_uplift"] = at_arms[:, model.unknowns.index("w")], recorded
    for name, (found, recorded) in pairs.items():
        if found.shape != recorded.shape:
            continue
        known = np.isfinite(recorded)
        off = np.abs(found - recorded)[known].max(initial=0.0)
        if not off <= _ROUNDING * max(1.0, np.abs(recorded[known]).max(initial=0.0)):
            raise _refusal(
                result,
                f"its state of step {step} does not belong to its records: its {name} is up to "
                f"{off:.3g} {CHANNELS[name].unit} off what they say",
            )


def _refuse_other_line(result: Path, results: Results, datasets: Mapping[str, np.ndarray]) -> None:
    for path, values in datasets.items():
        group, _, name = path.partition("/")
        there = results.line(name) if group == "line" else results.static(name)
        if np.shape(there) != np.shape(values) or not np.allclose(
            there, values, rtol=_RELATIVE, atol=_ABSOLUTE, equal_nan=True
        ):
            raise _refusal(result, f"its {path} is not that of its scene")


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, float) or isinstance(other, float):
        return bool(np.isclose(one, other, rtol=1e-12, atol=0.0))
    return bool(one == other)


def _refusal(result: Path, what: str) -> InputError:
    return InputError(f"{result} cannot be continued: {what}; start the run anew")


def extended_scene(
    config: dict[str, Any], file: str, until: float | None, evaluated: str | None
) -> Scene:
    """The checked scene of a run with a later end, or another evaluated stretch. Not collective.

    Parameters
    ----------
    config : of the run's result file
    file : its path, for sentences
    until : where the leading pantograph is to stop [m], None for where it stops now
    evaluated : ``FROM:TO`` [m], None for the stretch as it is

    Raises
    ------
    InputError
        If that is not later, or impossible.
    """
    raw, given = copy.deepcopy(config), []
    where = option("on the command line", "in restart()")
    if until is not None:
        end = float(raw["train"]["end_m"])
        if not (math.isfinite(until) and until > end):
            raise InputError(
                f"{option(*UNTIL)} is {until:g}, but must be greater than {end:g}: the run ends "
                "there"
            )
        raw["train"]["end_m"] = until
        given.append(("train.end_m", f"{where} ({option(*UNTIL)})"))
    if evaluated is not None:
        try:
            first, last = (float(part) for part in evaluated.split(":"))
        except ValueError:
            raise InputError(
                f"{option(*EVALUATE)} is {evaluated}, but must be two places [m]"
                f"{option(' as from:to, e.g. 360:600', ', e.g. (360, 600)')}"
            ) from None
        raw["evaluation"] |= {"from_m": first, "to_m": last}
        where = f"{where} ({option(*EVALUATE)})"
        given += [("evaluation.from_m", where), ("evaluation.to_m", where)]
    return scene_from(raw, Origin(file, tuple(given), recorded=True))
