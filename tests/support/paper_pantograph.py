"""The seven-body pantograph of the paper as its case has it: one home of Tables 2 to 4."""

from __future__ import annotations

from functools import lru_cache

from scenes import load_scene

from catenary.cases.scene.train.multibody import multibody_of
from catenary.cases.scene.train.pantograph import CorrectionTable, MultibodyTable
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, without_head
from catenary.mbs.rigid.system import System

BASE, LOWER_ARM, UPPER_ARM = "base", "lower_arm", "upper_arm"
LOWER_LINK, UPPER_LINK = "lower_link", "upper_link"
STABILISATION_ARM, HEAD, ACTUATOR = "stabilisation_arm", "head", "actuator"
SPEED = 300.0  # [km/h]


@lru_cache
def table() -> MultibodyTable:
    """The case's table."""
    found = load_scene("ambrosio2012").pantographs["seven_body"]
    assert isinstance(found, MultibodyTable)
    return found


def data(**changes: object) -> MultibodyData:
    """The pantograph, with other values of some keys of its table."""
    return multibody_of("seven_body", table().model_copy(update=changes), SPEED)


def pantograph(as_published: bool = False) -> System:
    """The seven bodies on a base at rest; joints are closed by `System.assemble`.

    With ``as_published`` the misprints are left as they are: the joints close then only in a
    shape more than a metre away from the published one, and not with the arm at its height.
    """
    return data(as_published=as_published).system


def frame() -> System:
    """The corrected pantograph without its head: five bodies on the base."""
    return without_head(data(), pantograph())


def corrections() -> dict[str, CorrectionTable]:
    """What differs from the paper, by key."""
    return {correction.key: correction for correction in table().corrections}


def number_at(key: str) -> float:
    """The number that the table has for a key of the corrections."""
    here: object = table().model_dump()
    for part in key.split("."):
        here = here[part] if isinstance(here, dict) else here[int(part)]  # type: ignore[index]
    assert isinstance(here, float)
    return here


# Height of the stabilisation arm above the base in Table 2 [m].
INITIAL_ARM_HEIGHT = table().working_height_m
