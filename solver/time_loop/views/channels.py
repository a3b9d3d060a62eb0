"""The channels of a run: one table of what is recorded, and where its values come from.

Time loop, recorder, result file, its reader and checks, report and documents all read
``CHANNELS``. To add a channel, add a row. Its ``values`` names an array that every step keeps up to
date; a step in the compiled loop copies it as well.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from catenary.solver.problem.watched_links import (
    HIGH_STOP,
    LOW_STOP,
    TENSION,
    TRAVEL,
    UPLIFT_STOPS,
    WEIGHT,
)

if TYPE_CHECKING:
    import numpy as np

    from catenary.solver.contact.forces_on_line import ForcesOnLine
    from catenary.solver.contact.pantographs import Pantographs
    from catenary.solver.problem.problem import Simulated
    from catenary.solver.schemes.scheme import Scheme

PANTOGRAPH = "pantograph"
ARM = "steady arm"
DROPPER = "dropper"
WIRE_END = "wire end"
STRIP = "strip"
WIRE = "contact wire"
CONTACT = "contact"
RUN = "run"


class Sources(NamedTuple):
    """Sources of the values of channels in one part of a march.

    ``arm_uplift`` [m] and ``dropper_force`` [N] are those of this rank, as ``link_force`` [N] of
    further links of one sign, by component, and ``gauges``, by what they show; models of
    pantographs are on rank 0 only.
    """

    pantographs: Pantographs
    interaction: ForcesOnLine
    scheme: Scheme
    arm_uplift: np.ndarray
    dropper_force: np.ndarray
    link_force: Mapping[str, np.ndarray]
    gauges: Mapping[str, np.ndarray] = MappingProxyType({})


class Energies(NamedTuple):
    """Sources of energies: ``kinetic`` and ``elastic`` energy of the line [J]."""

    kinetic: float
    elastic: float
    sources: Sources


class TrainLayout(NamedTuple):
    """Properties of train and line that determine the channels of a run.

    Attributes
    ----------
    n_strips : of each pantograph in running order
    joints_in_loop : whether a pantograph has joints that may open, all its bodies being moved
    n_wires : number of contact wires
    laws : settings of the effects, None without effects
    moves_along : whether wires move along the track
    """

    n_strips: tuple[int, ...]
    joints_in_loop: bool = False
    n_wires: int = 1
    laws: Simulated | None = None
    moves_along: bool = False

    @property
    def several_strips(self) -> bool:
        """Whether any pantograph has more than one strip."""
        return max(self.n_strips, default=1) > 1


@dataclass(frozen=True)
class Channel:
    """A recorded quantity.

    Attributes
    ----------
    name : name of the dataset in the result file
    unit : SI unit, "-" if none
    meaning : description with its sign, in words
    per : subject of a column: ``PANTOGRAPH``, ``STRIP``, ``ARM`` or ``DROPPER``; ``WIRE_END``
        for each end of a wire and side of a mid-point, of lines whose wires move along the track;
        ``WIRE`` for each contact wire under each pantograph; ``CONTACT`` for each contact wire on
        each strip, strip by strip; ``RUN`` for one value a row
    values : which array (columns,) of contiguous doubles holds the values after a step. Of places
        on the line these are the rank's own; of pantographs and strips rank 0 has them, and the
        array may be empty elsewhere. A function () -> (columns,) is called after each step, which
        then are taken one by one. None for clocks
    energy : for one of ``ENERGIES``: the value of this rank's, collective
    of_motion : whether an energy follows from ``kinetic`` and ``elastic`` alone, not from the
        sources: a compiled loop then does not end its block for it
    when : whether a run with this train on its line has it
    essential : whether a result file without it, or from its first damaged row on, is of no use
    may_be_nan : whether NaN is a value
    own_picture : whether the report draws it in a picture made for it; others get one of their own
    """

    name: str
    unit: str
    meaning: str
    per: str
    values: Callable[[Sources], np.ndarray | Callable[[], np.ndarray]] | None = None
    energy: Callable[[Energies], float] | None = None
    of_motion: bool = False
    when: Callable[[TrainLayout], bool] = lambda train: True
    essential: bool = False
    may_be_nan: bool = False
    own_picture: bool = False

    @property
    def of_line(self) -> bool:
        """Whether it has a column for each place on the line, which may be recorded in part."""
        return self.per in (ARM, DROPPER, WIRE_END)

    def n_columns(self, train: TrainLayout) -> int:
        """Columns of a channel of pantographs, strips or contact wires."""
        n, n_strips = len(train.n_strips), sum(train.n_strips)
        several = {STRIP: n_strips, WIRE: n * train.n_wires, CONTACT: n_strips * train.n_wires}
        return several.get(self.per, n)


def _nothing() -> np.ndarray:
    import numpy as np  # the command line reads names of channels, and loads no arrays for them

    return np.zeros(0)


def _gauge(name: str) -> Callable[[Sources], np.ndarray]:
    return lambda sources: sources.gauges.get(name, _nothing())


TIME = Channel("time", "s", "time since the start of the run", RUN)

CHANNELS: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Channel(
            "contact_position",
            "m",
            "position of the contact along the track",
            PANTOGRAPH,
            lambda sources: sources.pantographs.position,
            essential=True,
            own_picture=True,
        ),
        Channel(
            "contact_force",
            "N",
            "contact force, >= 0 in compression",
            PANTOGRAPH,
            lambda sources: sources.pantographs.contact_force,
            essential=True,
            own_picture=True,
        ),
        Channel(
            "head_height",
            "m",
            "height of the pan head above top of rail",
            PANTOGRAPH,
            lambda sources: sources.pantographs.head_height,
            essential=True,
            own_picture=True,
        ),
        Channel(
            "wire_height",
            "m",
            "height of the contact wire above top of rail where the pan head is",
            PANTOGRAPH,
            lambda sources: sources.pantographs.wire_height,
            essential=True,
            own_picture=True,
        ),
        Channel(
            "strip_force",
            "N",
            "share of a strip in the contact force, pantograph by pantograph, the leading strip "
            "first",
            STRIP,
            lambda sources: sources.pantographs.strip_force,
            when=lambda train: train.several_strips,
            own_picture=True,
        ),
        Channel(
            "contact_wire_force",
            "N",
            "share of a contact wire in the contact force, pantograph by pantograph, in the order "
            "of the wires",
            WIRE,
            lambda sources: sources.pantographs.contact_wire_force,
            when=lambda train: train.n_wires > 1,
            own_picture=True,
        ),
        Channel(
            "lateral_place",
            "m",
            "lateral position of a contact wire on a strip, to the left of the strip's middle, "
            "strip by strip in the order of the wires; NaN where it is not on the strip",
            CONTACT,
            lambda sources: sources.pantographs.lateral_place,
            when=lambda train: bool(train.laws and train.laws.lateral),
            may_be_nan=True,
            own_picture=True,
        ),
        Channel(
            "lateral_displacement",
            "m",
            "lateral displacement of a contact wire from rest where a strip meets it, to the left",
            CONTACT,
            lambda sources: sources.pantographs.lateral_displacement,
            when=lambda train: bool(train.laws and train.laws.lateral),
        ),
        Channel(
            "constraint_violation",
            "m",
            "largest open joint of a pantograph whose bodies are all moved, NaN for any other",
            PANTOGRAPH,
            lambda sources: sources.pantographs.constraint_violation,
            when=lambda train: train.joints_in_loop,
            may_be_nan=True,
            own_picture=True,
        ),
        Channel(
            "arm_uplift",
            "m",
            "uplift of the contact wire at a steady arm from equilibrium",
            ARM,
            lambda sources: sources.arm_uplift,
            own_picture=True,
        ),
        Channel(
            "dropper_force",
            "N",
            "tension of a dropper, negative in compression; of its spring alone where "
            "line.dropper.slack_damping keeps dampers in action",
            DROPPER,
            lambda sources: sources.dropper_force,
            own_picture=True,
        ),
        Channel(
            "stop_force",
            "N",
            "force of the stop above a steady arm on the contact wire, downward",
            ARM,
            lambda sources: sources.link_force.get(UPLIFT_STOPS, _nothing()),
            when=lambda train: bool(train.laws and train.laws.uplift_stops),
        ),
        *(
            Channel(
                name,
                unit,
                meaning,
                WIRE_END,
                _gauge(name),
                when=lambda train: train.moves_along,
            )
            for name, unit, meaning in (
                (
                    TENSION,
                    "N",
                    "tension of a wire at its end, or beside a mid-point anchor",
                ),
                (
                    TRAVEL,
                    "m",
                    "how far the end of a wire has moved outwards since the installation",
                ),
                (
                    WEIGHT,
                    "m",
                    "how far the weights of a tensioner have sunk since the installation",
                ),
                (LOW_STOP, "N", "force of the stop of weights at their lowest, >= 0"),
                (HIGH_STOP, "N", "force of the stop of weights at their highest, >= 0"),
            )
        ),
    )
}

ENERGIES: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Channel("time", "s", "time of the energies", RUN, essential=True),
        Channel(
            "kinetic",
            "J",
            "kinetic energy of the line",
            RUN,
            energy=lambda now: now.kinetic,
            of_motion=True,
            essential=True,
            own_picture=True,
        ),
        Channel(
            "elastic",
            "J",
            "elastic energy of the line relative to its equilibrium at the start",
            RUN,
            energy=lambda now: now.elastic,
            of_motion=True,
            essential=True,
            own_picture=True,
        ),
    )
}


def line_channels(train: TrainLayout | None = None) -> tuple[str, ...]:
    """Names of the channels with a column for each place on the line: all, or those that a run with
    this train has."""
    own = (channel for channel in CHANNELS.values() if channel.of_line)
    return tuple(c.name for c in own if train is None or c.when(train))


def line_channels_of_all() -> tuple[str, ...]:
    """Names of the channels of the line that every run has."""
    return line_channels(TrainLayout(()))


def train_channels(train: TrainLayout | None = None) -> tuple[Channel, ...]:
    """Channels of pantographs and strips: all, or the channels of a run with this train."""
    own = (channel for channel in CHANNELS.values() if not channel.of_line)
    return tuple(channel for channel in own if train is None or channel.when(train))


def energies_follow_motion() -> bool:
    """Whether all energies can be taken from a motion that was kept."""
    return all(channel.of_motion for channel in ENERGIES.values() if channel.energy is not None)


def energies_of(now: Energies) -> tuple[float, ...]:
    """The values of ``ENERGIES`` but the time. Collective."""
    return tuple(c.energy(now) for c in ENERGIES.values() if c.energy is not None)
