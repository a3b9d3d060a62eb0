"""Head of a result file: what is known before the first step.

Root attributes and constant datasets (`Header`), the recorded part of the line's channels, which
is one of the attributes (`LineRecord`: cadence, window, stretch, names, compression), and how
pantographs are called by their places on the train.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator

from catenary.meshgen.wires import Role
from catenary.solver.time_loop.views import channels

if TYPE_CHECKING:
    from catenary.meshgen.line import Line
    from catenary.meshgen.mesh import LineMesh
    from catenary.solver.model.rest_shape import Equilibrium
    from catenary.solver.statics.elasticity import Elasticity

NONE, GZIP = "none", "gzip"
# Level 4 was not smaller than level 1 on the forces of droppers, and slower.
GZIP_LEVEL = 1


@dataclass(frozen=True)
class Header:
    """Root attributes and constant datasets of a result file; only rank 0 needs it.

    Attributes
    ----------
    attributes : as `RunAttributes`; text and numbers are stored as they are, lists and tables as
        JSON. ``system`` is a key of ``postproc.standards``, ``rules`` lists names of rule books,
        and whole ones; ``effects_on`` and ``effects_off`` are lists of (name, title, reason).
    datasets : path in the file -> array, from ``line_datasets`` and ``static_datasets``
    facts : name -> value of all facts, from ``facts_of``
    """

    attributes: Mapping[str, Any]
    datasets: Mapping[str, np.ndarray]
    facts: Mapping[str, np.ndarray]


def wire_roles(line: Line) -> dict[str, str]:
    """Root attribute ``wires``: the role of each wire by its name, in the order of the line."""
    return {wire.name: wire.role.value for wire in line.wires}


def line_datasets(
    line: Line, mesh: LineMesh, evaluation: tuple[float, float]
) -> dict[str, np.ndarray]:
    """Datasets of ``/line``: masts, spans of the droppers, ranges, chains of nodes. Not collective.

    Parameters
    ----------
    line : Line
        The line.
    mesh : LineMesh
        Mesh of the line.
    evaluation : tuple of float
        Stretch whose statistics are judged, from and to [m].
    """
    masts = line.support_positions
    dropper_x = mesh.x(mesh.droppers[:, 1])
    datasets = {
        "line/support_x": masts,
        "line/dropper_span": np.searchsorted(masts, dropper_x, side="right") - 1,
        "line/running_range": np.array(line.running_range),
        "line/evaluation_range": np.array(evaluation, dtype=float),
        "line/droppers": np.asarray(mesh.droppers, dtype=np.int64),
        "line/arm_wire": _arm_wire(line, mesh),
    }
    for name, nodes in mesh.wires.items():
        datasets[f"line/wires/{name}"] = np.asarray(nodes, dtype=np.int64)
    for name, breaks in mesh.breaks.items():
        datasets[f"line/breaks/{name}"] = np.asarray(breaks, dtype=np.int64)
    return datasets


def _arm_wire(line: Line, mesh: LineMesh) -> np.ndarray:
    """Number of the wire that each steady arm holds, in the order of the line, (n_arms,)."""
    names = [wire.name for wire in line.wires]
    of_group = np.array([names.index(arms.wire) for arms in line.steady_arms], dtype=np.int64)
    return of_group[mesh.arm_group] if of_group.size else np.zeros(0, dtype=np.int64)


def static_datasets(
    line: Line,
    mesh: LineMesh,
    equilibrium: Equilibrium,
    elasticity: Elasticity,
) -> dict[str, np.ndarray]:
    """Datasets of ``/static``: droppers, profiles, registration and elasticity at rest, but not the
    lengths to which droppers are cut. Not collective.

    Parameters
    ----------
    line : Line
        The line.
    mesh : LineMesh
        Mesh of the line.
    equilibrium : Equilibrium
        The line at rest.
    elasticity : Elasticity
        Elasticity of the line at rest.
    """
    contact = np.concatenate([mesh.wires[wire.name] for wire in line.wires_of(Role.CONTACT)])
    return {
        "static/dropper_force": equilibrium.dropper_force,
        "static/contact_x": mesh.x(contact),
        "static/contact_height": equilibrium.height[contact],
        "static/elasticity_x": elasticity.x,
        "static/elasticity": elasticity.lift,
        "static/elasticity_of_wires": elasticity.of_wires,
        **_registration(line, mesh, equilibrium),
    }


def _registration(line: Line, mesh: LineMesh, form: Equilibrium) -> dict[str, np.ndarray]:
    """Forces of steady arms at rest, and lateral positions of the contact wires where they move so.

    Without lateral motion arms carry the radial force of the stagger; nothing for straight wires.
    """
    if form.lateral is not None:
        contact = np.concatenate([mesh.wires[wire.name] for wire in line.wires_of(Role.CONTACT)])
        return {
            "static/arm_stagger": form.lateral.y[mesh.steady_arms],
            "static/arm_force": form.lateral.arm_force,
            "static/arm_tension": form.lateral.arm_tension,
            "static/contact_y": form.lateral.y[contact],
        }
    stagger, force = np.zeros(mesh.steady_arms.size), np.zeros((mesh.steady_arms.size, 3))
    for number, arms in enumerate(line.steady_arms):
        mine = mesh.arm_group == number
        x, wire = mesh.x(mesh.steady_arms[mine]), line.wire(arms.wire)
        stagger[mine], force[mine, 0] = wire.points(x)[:, 1], wire.radial_force(x)
    if not force.any():
        return {}
    if form.arm_lift.size:
        force[:, 1] = form.arm_lift
    tension = np.linalg.norm(force, axis=1)
    return {
        "static/arm_stagger": stagger,
        "static/arm_force": force,
        "static/arm_tension": tension,
    }


Place = Annotated[float, Field(allow_inf_nan=False)]
# Names of the record in the result file, where they differ.
_IN_FILE = {
    "every": "every_steps", "window": "window_m", "stretch": "stretch_m", "names": "channels",
}  # fmt: skip


class LineRecord(BaseModel):
    """Recorded part of the channels with a column for each arm, dropper or wire end.

    Attributes
    ----------
    every : steps between two rows
    window : how far behind the last and ahead of the first pantograph columns are recorded [m],
        None for the whole line; what is outside is NaN
    stretch : from and to of the columns that are recorded [m], None for all
    names : channels that are recorded
    compression : ``NONE`` or ``GZIP``
    by_size : whether cadence, window and compression follow from the size of the whole record
    """

    model_config = ConfigDict(
        frozen=True, populate_by_name=True, alias_generator=lambda name: _IN_FILE.get(name, name)
    )

    every: Annotated[int, Field(ge=1, le=10**9)] = 1
    window: tuple[Place, Place] | None = None
    stretch: tuple[Place, Place] | None = None
    names: tuple[str, ...] = Field(default_factory=channels.line_channels)
    compression: str = NONE
    by_size: bool = False

    @field_validator("names")
    @classmethod
    def _are_channels(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        if not set(names) <= set(channels.line_channels()):
            raise ValueError("no channels of the line")
        return names

    @property
    def whole(self) -> bool:
        """Whether every channel is recorded at every step on the whole line."""
        return (
            self.every == 1
            and self.window is None
            and self.stretch is None
            and set(self.names) >= set(channels.line_channels_of_all())
        )

    def of(self, train: channels.TrainLayout) -> LineRecord:
        """Return this record for a run with this train, which may lack some of the channels."""
        there = channels.line_channels(train)
        names = tuple(name for name in self.names if name in there)
        return self.model_copy(update={"names": names})

    def columns(self, x: np.ndarray) -> np.ndarray:
        """Indices of the columns at positions ``x`` [m] that are recorded, ascending."""
        if self.stretch is None:
            return np.arange(x.size)
        low, high = self.stretch
        return np.flatnonzero((x >= low - 1e-6) & (x <= high + 1e-6))

    def within(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """From and to of the window at each row, (rows,) each [m]; None without a window.

        Parameters
        ----------
        position : ndarray, shape (rows, n_pantographs)
            Places of the pantographs along the track [m].
        """
        if self.window is None:
            return None
        behind, ahead = self.window
        return position.min(axis=1) - behind, position.max(axis=1) + ahead


def record_words(record: LineRecord, dt: float) -> str:
    """Recorded part, in words, at a time step of ``dt`` [s]."""
    if not record.names:
        return "not recorded; extremes are kept of every step"
    if record.whole:
        words = "recorded at every step"
    else:
        every = "at every step" if record.every == 1 else f"every {1e3 * record.every * dt:g} ms"
        words = f"recorded {every}"
        if record.window is not None:
            behind, ahead = record.window
            words += f" within {behind:g} m behind and {ahead:g} m ahead of the train"
        if record.stretch is not None:
            words += f" from {record.stretch[0]:g} to {record.stretch[1]:g} m"
        if not set(record.names) >= set(channels.line_channels_of_all()):
            words = f"of these {', '.join(record.names)} {words}"
        words += "; extremes are kept of every step"
    if record.compression != NONE:
        words += "; compressed"
    return words + (" (chosen by size)" if record.by_size else "")


def places_on_train(n: int) -> list[str]:
    """Names of ``n`` pantographs by their places, from the first: ``leading``, ``trailing``."""
    if n == 1:
        return ["pantograph"]
    return ["leading", *(f"no. {place}" for place in range(2, n)), "trailing"]


def in_sentence(place: str) -> str:
    """A pantograph by its place on the train: ``the leading pantograph``, ``the pantograph``."""
    if place == "pantograph":
        return "the pantograph"
    return f"pantograph {place}" if place.startswith("no. ") else f"the {place} pantograph"
