"""Checkpoints: everything that a march needs to go on from a step, made and put back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.base.parallel import on_root
from catenary.solver.contact.pantographs import Pantographs
from catenary.solver.integrators.line_integrator import MOTION, LineIntegrator
from catenary.solver.model.model import Model
from catenary.solver.schemes.scheme import Scheme

# Unknowns of a node that are displacements [m].
_MOVES = ("u", "v", "w")


class State(Mapping[str, Any]):
    """A state by name, of which each array is made when it is read: those of a long line are large.

    To be read before the next step; ``dict`` of it keeps.
    """

    def __init__(self, made_by: Mapping[str, Callable[[], Any]]) -> None:
        self._made_by = made_by

    def __getitem__(self, name: str) -> Any:
        return self._made_by[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._made_by)

    def __len__(self) -> int:
        return len(self._made_by)


class Checkpoints:
    """States of a marched line and train, from the arrays that the march steps.

    Parameters
    ----------
    comm : mpi4py communicator
    model : of the line as it is now
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        line: LineIntegrator,
        pantographs: Pantographs,
        scheme: Scheme,
    ) -> None:
        self._comm, self._model, self._line = comm, model, line
        self._pantographs, self._scheme = pantographs, scheme
        self._outputs = ["contact_force", "head_height", "wire_height", "strip_force"]
        self._outputs += ["contact_wire_force"] if pantographs.n_wires > 1 else []
        self._outputs += ["across"] if pantographs.lateral else []

    def make(self, step: int) -> State | None:
        """State to continue from after ``step``, the latest one, on rank 0. Collective."""
        line, pantographs = self._line, self._pantographs
        by_row = self._unknowns_by_row
        made_by: dict[str, Callable[[], Any]] = {}
        for name, own in line.exact_state().items():
            if self._comm.size == 1:
                made_by[name] = partial(_in_rows, own, by_row)
            elif parts := self._comm.gather(own(), root=0):
                whole = _in_rows(partial(np.concatenate, parts), by_row)
                made_by[name] = partial(np.asarray, whole)
        past = line.past()
        if self._comm.rank != 0:
            return None
        if past is not None:
            made_by["line_past"] = partial(np.asarray, past)
        made_by["row_of_node"] = partial(np.asarray, self._model.row_of_node)
        made_by["step"] = lambda: step
        for name in self._outputs:
            made_by[name] = partial(np.array, getattr(pantographs, name))
        made_by["contacts"] = self._scheme.state
        if line.window is not None:
            made_by["window"] = line.window.state
        for i, pantograph in enumerate(pantographs.models):
            made_by[f"pantograph_{i}"] = pantograph.state
        return State(made_by)

    @cached_property
    def _unknowns_by_row(self) -> np.ndarray | None:
        """Numbers of all unknowns, node after node along the track; negative for none. None if they
        stand in this order: a long line has room for few arrays of its size."""
        model = self._model
        nodes = np.empty_like(model.row_of_node)
        nodes[model.row_of_node] = np.arange(nodes.size)
        by_row = model.numbering.numbers[nodes].ravel()
        return None if np.array_equal(by_row, np.arange(model.n_dofs)) else by_row

    def restore(self, checkpoint: dict[str, Any]) -> None:
        """Continue from a checkpoint, which all ranks pass. Collective.

        Raises
        ------
        InputError
            If it does not say which node its unknowns belong to, or is not one of this line with
            these pantographs and methods; nothing was restored then.
        """
        line, pantographs = self._line, self._pantographs
        states = self._states_of_line(checkpoint)
        outputs = {
            name: like(checkpoint, name, getattr(pantographs, name)) for name in self._outputs
        }
        on_root(self._comm, lambda: self._refuse_other_states(checkpoint))
        if line.remembers:
            if "line_past" not in checkpoint:
                raise impossible("line_past is missing")
            line.recall(np.asarray(checkpoint["line_past"]), int(checkpoint["step"]))
        line.restore(states)
        if line.window is not None and "window" in checkpoint:
            line.window.restore(like(checkpoint, "window", line.window.state()))
        for name, values in outputs.items():
            getattr(pantographs, name)[:] = values
        self._scheme.restore(checkpoint["contacts"])
        for i, pantograph in enumerate(pantographs.models):
            pantograph.restore(checkpoint[f"pantograph_{i}"])

    def _states_of_line(self, checkpoint: dict[str, Any]) -> dict[str, np.ndarray]:
        """The rank's part of the line's motion, by name, each (n_local,)."""
        line, model = self._line, self._model
        if "row_of_node" not in checkpoint:
            raise InputError(
                "the state to continue from was written by an earlier version of Catenary, which "
                "this one cannot continue; start the run anew"
            )
        n_nodes, names = model.mesh.n_nodes, len(model.unknowns)
        row_of_node = like(checkpoint, "row_of_node", model.row_of_node)
        other = np.flatnonzero(row_of_node != model.row_of_node)
        if other.size:
            node = int(other[0])
            raise impossible(
                f"row_of_node puts node {node} in row {row_of_node[node]:g}, and along this line "
                f"it is in row {model.row_of_node[node]}"
            )
        owned = slice(line.ownership.first, line.ownership.last)
        states = {}
        for name in line.exact_state():
            if name in checkpoint or name in MOTION:
                by_row = np.reshape(like(checkpoint, name, np.empty(n_nodes * names)), (-1, names))
                self._refuse_far(name, by_row)
                states[name] = model.numbering.as_vector(by_row[row_of_node])[owned]
        return states

    def _refuse_far(self, name: str, by_row: np.ndarray) -> None:
        """Raise InputError for displacements ``by_row`` (n_nodes, unknowns) that cannot be: no node
        moves further than the line is long. Slopes, and what is no displacement, are let pass."""
        if name != "displacement":
            return
        columns = [number for number, own in enumerate(self._model.unknowns) if own in _MOVES]
        largest = float(np.abs(by_row[:, columns]).max(initial=0.0))
        length = float(np.ptp(self._model.mesh.points[:, 0]))
        if largest > length:
            raise impossible(f"a node is {largest:g} m from rest on a line of {length:g} m")

    def _refuse_other_states(self, checkpoint: dict[str, Any]) -> None:
        """Raise InputError unless the states of contacts and pantographs are of their kinds.

        On rank 0, which has them.
        """
        like(checkpoint, "contacts", self._scheme.state())
        for i, pantograph in enumerate(self._pantographs.models):
            like(checkpoint, f"pantograph_{i}", pantograph.state())


def _in_rows(vector: Callable[[], np.ndarray], by_row: np.ndarray | None) -> np.ndarray:
    """A vector of the line by the numbers ``by_row``, zero where there is none; as it stands if
    they are None, and an array of its own."""
    if by_row is None:
        return np.array(vector())
    result = vector()[by_row]
    result[by_row < 0] = 0.0
    return result


def like(checkpoint: dict[str, Any], name: str, wanted: np.ndarray) -> np.ndarray:
    """The finite array of a checkpoint that is to have the shape of ``wanted``."""
    if name not in checkpoint:
        raise impossible(f"{name} is missing")
    values, shape = np.asarray(checkpoint[name]), np.shape(wanted)
    if values.dtype.kind not in "fiub" or values.shape != shape:
        raise impossible(f"{name} has the shape {values.shape} in place of {shape}")
    if not np.isfinite(values).all():
        raise impossible(f"{name} holds NaN or infinity")
    return values


def impossible(what: str) -> InputError:
    """The error of a state that is of another scene."""
    return InputError(
        f"the state to continue from does not belong to this scene: {what}; start the run anew"
    )
