"""The channels of a run: one table of names, units and meanings for files, CSV and plots."""

from __future__ import annotations

from dataclasses import dataclass

PANTOGRAPH = "pantograph"
ARM = "steady arm"
DROPPER = "dropper"
STRIP = "strip"
RUN = "run"


@dataclass(frozen=True)
class Channel:
    """A recorded quantity.

    Attributes
    ----------
    name : name of the dataset in the result file
    unit : SI unit, "-" if none
    meaning : what it is and which sign it has, in words
    per : what a column stands for: ``PANTOGRAPH``, ``ARM``, ``DROPPER``, ``STRIP``, or ``RUN`` for
        one value a step
    """

    name: str
    unit: str
    meaning: str
    per: str

    @property
    def label(self) -> str:
        """Name and unit for a table head, for instance ``contact_force [N]``."""
        return f"{self.name} [{self.unit}]"


TIME = Channel("time", "s", "time since the start of the run", RUN)

CHANNELS: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Channel("contact_position", "m", "position of the contact along the track", PANTOGRAPH),
        Channel("contact_force", "N", "contact force, >= 0 in compression", PANTOGRAPH),
        Channel("head_height", "m", "height of the pan head above top of rail", PANTOGRAPH),
        Channel(
            "wire_height",
            "m",
            "height of the contact wire above top of rail where the pan head is",
            PANTOGRAPH,
        ),
        Channel(
            "arm_uplift", "m", "uplift of the contact wire at a steady arm from equilibrium", ARM
        ),
        Channel(
            "dropper_force",
            "N",
            "tension of a dropper, negative in compression; of its spring alone where "
            "line.dropper.slack_damping keeps dampers in action",
            DROPPER,
        ),
    )
}

# Those with a column for each place on the line, which may be recorded in part.
LINE_CHANNELS = tuple(c.name for c in CHANNELS.values() if c.per in (ARM, DROPPER))

# Only of runs in which a pantograph has more than one strip.
STRIP_FORCE = Channel(
    "strip_force",
    "N",
    "share of a strip in the contact force, pantograph by pantograph, the leading strip first",
    STRIP,
)

# Only of runs in which all bodies of a pantograph are moved.
CONSTRAINT_VIOLATION = Channel(
    "constraint_violation",
    "m",
    "largest open joint of a pantograph whose bodies are all moved, NaN for any other",
    PANTOGRAPH,
)

ENERGIES: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Channel("time", "s", "time of the energies", RUN),
        Channel("kinetic", "J", "kinetic energy of the line", RUN),
        Channel(
            "elastic",
            "J",
            "elastic energy of the line relative to its equilibrium at the start",
            RUN,
        ),
    )
}
