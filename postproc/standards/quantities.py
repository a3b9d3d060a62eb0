"""Quantities that a rule book may judge, keys of a scene that may limit them, and supply systems.

``evaluate.observations`` takes the quantities from a run. Books, their checks and the documents
read these tables alone.
"""

from __future__ import annotations

from typing import NamedTuple

SYSTEMS = {"ac": "AC", "dc_3kv": "DC 3 kV", "dc_1500v": "DC 1.5 kV"}
KMH = 3.6  # km/h in 1 m/s; books state limits over the speed in km/h

# Parts of a run that a quantity has a value for.
RUN, PANTOGRAPH = "run", "pantograph"


class Quantity(NamedTuple):
    """A quantity: unit in which books state its limits, meaning, what has a value of it, and
    whether it is a number of the scene, which stands at a limit on purpose."""

    unit: str
    meaning: str
    per: str = RUN
    given: bool = False


class LimitKey(NamedTuple):
    """A key of ``evaluation.limits``: unit, meaning."""

    unit: str
    meaning: str


QUANTITIES: dict[str, Quantity] = {
    "mean_force": Quantity("N", "mean contact force below 20 Hz", PANTOGRAPH),
    "force_std": Quantity("N", "standard deviation of the contact force below 20 Hz", PANTOGRAPH),
    "force_max": Quantity("N", "largest contact force below 20 Hz", PANTOGRAPH),
    "force_min": Quantity("N", "smallest contact force below 20 Hz", PANTOGRAPH),
    "force_stat_max": Quantity(
        "N", "mean contact force plus three standard deviations", PANTOGRAPH
    ),
    "force_stat_min": Quantity(
        "N", "mean contact force minus three standard deviations", PANTOGRAPH
    ),
    "contact_height_range": Quantity(
        "mm", "highest minus lowest contact point, below 20 Hz", PANTOGRAPH
    ),
    "arcing": Quantity("%", "share of time in losses of contact of 5 ms and longer", PANTOGRAPH),
    "strip_place": Quantity(
        "mm", "farthest place of a contact wire from the middle of the strips", PANTOGRAPH
    ),
    "strip_half_length": Quantity("mm", "half length of the strips", PANTOGRAPH, given=True),
    "distance_ahead": Quantity("m", "distance to the pantograph ahead", PANTOGRAPH, given=True),
    "arm_uplift": Quantity("mm", "largest uplift of the contact wire at a steady arm"),
    "train_speed": Quantity("km/h", "speed of the train", given=True),
    "wave_speed": Quantity("km/h", "speed of the slowest wave of the contact wire", given=True),
    "wire_height_max": Quantity("mm", "largest height of the contact wire at rest"),
    "wire_height_min": Quantity("mm", "smallest height of the contact wire at rest"),
    "wire_gradient": Quantity(
        "per mille", "largest gradient of the contact wire at rest from steady arm to steady arm"
    ),
    "wire_gradient_change": Quantity(
        "per mille", "largest change of that gradient at a steady arm"
    ),
    "wire_lateral_place": Quantity(
        "mm", "farthest place of the contact wire at rest from the axis of the track"
    ),
    "lateral_sweep": Quantity(
        "mm/s", "mean speed of the contact point across the strips, by the wire at rest"
    ),
    "elasticity_variation": Quantity(
        "%", "largest minus smallest elasticity over their sum, in the reference span"
    ),
    "dropper_force_max": Quantity("N", "largest force of a dropper"),
    "dropper_compression": Quantity("N", "largest compression of a dropper"),
    "dropper_slackenings": Quantity("times", "how often the same dropper slackens, at most"),
    "contact_wire_tension": Quantity("N", "largest tension of a contact wire"),
    "contact_wire_strain": Quantity(
        "um/m", "largest bending strain of a contact wire under the contact force (estimate)"
    ),
}

LIMIT_KEYS: dict[str, LimitKey] = {
    "uplift_space_mm": LimitKey("mm", "space that a steady arm leaves to the wire's uplift"),
    "working_width_mm": LimitKey("mm", "width of the head on which the contact wire may run"),
    "wire_lateral_place_mm": LimitKey("mm", "allowed distance of the wire at rest from the axis"),
    "wire_height_min_mm": LimitKey("mm", "lowest allowed contact wire at rest"),
    "wire_height_max_mm": LimitKey("mm", "highest allowed contact wire at rest"),
    "lateral_sweep_mm_per_s": LimitKey("mm/s", "least speed of the contact point across strips"),
    "elasticity_variation_percent": LimitKey("%", "allowed variation of the elasticity in a span"),
    "arcing_percent": LimitKey("%", "allowed share of time in losses of contact"),
    "dropper_force_N": LimitKey("N", "allowed force of a dropper"),
    "dropper_compression_N": LimitKey("N", "compression at which a dropper buckles"),
    "dropper_slackenings": LimitKey("times", "how often a dropper may slacken"),
    "contact_wire_tension_N": LimitKey("N", "allowed tension of a contact wire, worn as it is"),
    "contact_wire_strain_um_per_m": LimitKey("um/m", "allowed bending strain of a contact wire"),
}
