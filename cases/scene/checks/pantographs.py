"""Whether the pantographs of a scene and their laws can be what they say."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.base.errors import InputError, RunBroken
from catenary.cases.scene.input.faults import Fault, shown
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.train.mechanism import ActuatorTable
from catenary.cases.scene.train.pantograph import LumpedTable, MultibodyTable, wanted_force
from catenary.mbs.frame import SPACE
from catenary.meshgen.topologies.line_data import LineData

if TYPE_CHECKING:
    from catenary.mbs.mechanism.pantograph_data import MultibodyData


# By how much the arm may be further down than the head while both fall [m].
_LEADS = 0.05


def check_pantographs(scene: Scene) -> Iterator[Fault]:
    """Names and forces that are wrong with a kind of pantograph."""
    on_the_train = {place.name for place in scene.train.pantographs}
    yield from _static_forces(scene, on_the_train)
    for name, table in scene.pantographs.items():
        if isinstance(table, MultibodyTable):
            yield from _names(scene, name, table)
            yield from _actuator(scene, name, table)


def check_mechanisms(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Mechanisms on the train that cannot be assembled, or do not reach the wire from the height
    that ``nominal_height_m`` puts them to. Names and forces have no fault.

    The machinery of multibody systems is imported here, for scenes that have a mechanism.
    """
    on_the_train = {place.name for place in scene.train.pantographs}
    found: list[Fault] = []
    for name, table in scene.pantographs.items():
        if name in on_the_train and isinstance(table, MultibodyTable):
            found += _mechanism(scene, name, table)
    yield from found or _heights(scene, line)


def _heights(scene: Scene, line: LineData) -> Iterator[Fault]:
    lowest = line.lowest_contact
    heights = lowest, line.contact_height
    for name in dict.fromkeys(place.name for place in scene.train.pantographs):
        table = scene.pantographs[name]
        if not isinstance(table, MultibodyTable) or table.nominal_height_m is None:
            continue
        data, working = _standing(scene, name, table)
        for height in heights:
            if _reaches(data, working + height - table.nominal_height_m):
                continue
            yield scene.refused(
                f"pantographs.{name}.nominal_height_m",
                f"the contact wire hangs at {lowest:.4g} to {line.contact_height:.4g} m, where its "
                f"head would be {height - table.nominal_height_m:+.4g} m away from there, beyond "
                "the reach of its mechanism",
            )
            break


def reaches_below(scene: Scene, name: str, line: LineData, drop: float) -> bool:
    """Whether a kind of pantograph can go down by ``drop`` [m] from wherever the wire is."""
    table = scene.pantographs[name]
    if not isinstance(table, MultibodyTable):
        return True
    lowest = line.lowest_contact
    nominal = line.contact_height if table.nominal_height_m is None else table.nominal_height_m
    data, working = _standing(scene, name, table)
    return _reaches(data, working + lowest - nominal - drop - _LEADS)


def _standing(scene: Scene, name: str, table: MultibodyTable) -> tuple[MultibodyData, float]:
    """A mechanism and the height of its arm above its base where it stands [m]."""
    from catenary.cases.scene.train.multibody import multibody_of
    from catenary.mbs.mechanism.pantograph_data import stand

    data = multibody_of(name, table, scene.train.speed_km_h)
    return data, stand(data).working_height


def _reaches(data: MultibodyData, arm: float) -> bool:
    """Whether a mechanism can have its arm at a height above its base [m]."""
    from catenary.mbs.mechanism.pantograph_data import HOLDER, reduced, stand
    from catenary.mbs.rigid.joints import PrescribedPoint, constant

    if data.all_bodies is None:
        heights = reduced(data).heights
        return bool(heights[0] <= arm <= heights[-1])
    standing = stand(data)
    holder = PrescribedPoint(HOLDER, data.arm, constant(arm))
    try:
        standing.system.with_joints(holder).assemble(standing.motion)
    except InputError:
        return False
    return True


def _names(scene: Scene, kind: str, table: MultibodyTable) -> Iterator[Fault]:
    key = f"pantographs.{kind}"
    bodies = list(table.bodies)
    if SPACE in bodies:
        yield _refusal(
            scene, f"{key}.bodies.{SPACE}", "is the name of the frame at rest; choose another"
        )
    for role in ("head", "arm"):
        yield from scene.among(f"{key}.{role}", bodies)
    if table.head == table.arm:
        yield _refusal(
            scene, f"{key}.head", f"is {shown(table.head)} as the arm is; they are two bodies"
        )
    if table.actuator is not None:
        yield from scene.among(f"{key}.actuator", list(table.forces))
    for place in _uses(table):
        # What is on one body alone would be without effect on what is at rest.
        on_one = place.endswith(".body")
        yield from scene.among(f"{key}.{place}", bodies if on_one else [*bodies, SPACE])
    for what in ("joints", "forces"):
        for label, one in getattr(table, what).items():
            if getattr(one, "i", None) == getattr(one, "j", SPACE):
                yield _refusal(scene, f"{key}.{what}.{label}", f"has {shown(one.i)} on both sides")
    for label in table.forces:
        if label in table.joints or label == "gravity":
            yield _refusal(scene, f"{key}.forces.{label}", "has the name of a joint or of gravity")


def _uses(table: MultibodyTable) -> Iterator[str]:
    """Keys of joints and forces that hold names of bodies."""
    for what in ("joints", "forces"):
        for label, one in getattr(table, what).items():
            for end in ("i", "j", "body"):
                if hasattr(one, end):
                    yield f"{what}.{label}.{end}"


def _actuator(scene: Scene, kind: str, table: MultibodyTable) -> Iterator[Fault]:
    if not table.calibrate or table.actuator not in table.forces:
        return
    force = table.forces[table.actuator]
    key = f"pantographs.{kind}.actuator"
    if not isinstance(force, ActuatorTable):
        yield scene.refused(key, f"that is a {force.type}, no actuator")
    elif force.force_N is None:
        why = "its force is a table, so that it cannot be calibrated; write calibrate = false"
        yield scene.refused(key, why)


def _static_forces(scene: Scene, on_the_train: set[str]) -> Iterator[Fault]:
    speed = scene.train.speed_km_h
    for name, table in scene.pantographs.items():
        if name not in on_the_train or table.static_force_by_speed is None:
            continue
        if wanted_force(table, speed) is None:
            first, last = table.static_force_by_speed[0][0], table.static_force_by_speed[-1][0]
            key = "train.speed_km_h"
            held = f"{first:g} km/h" if first == last else f"{first:g} to {last:g} km/h"
            yield Fault(
                key,
                f"{key} is {speed:g} km/h {scene.origin.of(key)}; "
                f"pantographs.{name}.static_force_by_speed only holds forces for {held}",
            )


def _mechanism(scene: Scene, name: str, table: MultibodyTable) -> Iterator[Fault]:
    try:
        _standing(scene, name, table)
    except (InputError, RunBroken) as error:
        key = f"pantographs.{name}"
        yield scene.fault(key, f"cannot be built: {error}")


def _refusal(scene: Scene, key: str, says: str) -> Fault:
    return Fault(key, f"{key} {says} {scene.origin.of(key)}")


def check_laws(scene: Scene) -> Iterator[Fault]:
    """Laws on masses that are not there, and what all bodies or slow samples do not allow."""
    for name, table in scene.pantographs.items():
        key = f"pantographs.{name}"
        lumped = isinstance(table, LumpedTable)
        n = len(table.masses_kg) if isinstance(table, LumpedTable) else 2
        for number, law in enumerate(table.laws):
            if law.at_mass is not None and law.at_mass > n:
                has = f"{n} masses" if lumped else "2, the head and the arm"
                yield scene.refused(f"{key}.laws.{number}.at_mass", f"the pantograph has {has}")
        whole = not isinstance(table, LumpedTable) and table.motion == "all_bodies"
        for part, given in (("laws", table.laws), ("regulation", table.regulation)):
            if whole and given:
                yield scene.refused(
                    f"{key}.motion",
                    f"{key}.{part} acts on mechanisms that are reduced to tables only",
                )
        regulation = table.regulation
        if regulation is not None and regulation.sample_s < scene.numerics.dt_s:
            yield scene.refused(
                f"{key}.regulation.sample_s",
                f"a sample takes at least a step, numerics.dt_s = {scene.numerics.dt_s:g}",
            )
