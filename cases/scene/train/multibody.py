"""From the table of a multibody pantograph to its mechanism, in SI units.

Only scenes that have one import this, and with it the machinery of multibody systems.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from catenary.cases.scene.keys.units import angle_from_deg, speed_from_km_h
from catenary.cases.scene.train import mechanism as schema
from catenary.cases.scene.train.head import strips_of
from catenary.cases.scene.train.pantograph import MultibodyTable, wanted_force
from catenary.mbs.mechanism.multibody_pantograph import AllBodies, MultibodyData
from catenary.mbs.rigid.bodies import Body
from catenary.mbs.rigid.forces import (
    Actuator,
    BumpStop,
    Force,
    Gravity,
    PointForce,
    SpringDamper,
    Table,
)
from catenary.mbs.rigid.joints import (
    Constant,
    Fixed,
    Joint,
    PointOnCurve,
    PointOnLine,
    PrescribedAngle,
    PrescribedPoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    Spherical,
)
from catenary.mbs.rigid.system import System, turned_round


def turned(data: MultibodyData) -> MultibodyData:
    """A pantograph that runs the other way round."""
    return replace(data, system=turned_round(data.system))


def multibody_of(name: str, table: MultibodyTable, speed_km_h: float) -> MultibodyData:
    """A multibody pantograph; aerodynamic forces are those at the train speed [km/h]."""
    table = table.in_force()
    bodies = tuple(
        Body(body, b.mass_kg, tuple(b.inertia_kg_m2), tuple(b.position_m), tuple(b.turn))
        for body, b in table.bodies.items()
    )
    forces: list[Force] = []
    wind = []
    if table.gravity:
        forces.append(Gravity(tuple(body.mass for body in bodies)))
    for label, force in table.forces.items():
        if isinstance(force, schema.AerodynamicForceTable):
            square = speed_from_km_h(speed_km_h) ** 2
            strength = tuple(c * square for c in force.coefficient_N_s2_per_m2)
            wind.append(PointForce(label, force.body, strength, tuple(force.at_m)))
        else:
            forces.append(_force(label, force))
    joints = tuple(_joint(label, joint) for label, joint in table.joints.items())
    return MultibodyData(
        name=name,
        system=System(bodies, joints, tuple(forces)),
        head=table.head,
        arm=table.arm,
        working_height=table.working_height_m,
        actuator=table.actuator if table.calibrate else None,
        static_force=wanted_force(table, speed_km_h),
        assembly_tolerance=table.assembly_tolerance_m,
        wind=tuple(wind),
        strips=strips_of(table.strips),
        all_bodies=(
            AllBodies(table.constraint_handling, table.substeps)
            if table.motion == "all_bodies"
            else None
        ),
    )


def _joint(name: str, t: schema.JointTable) -> Joint:
    if isinstance(t, schema.PointOnCurveTable):
        x, y, z = (tuple(column) for column in zip(*t.curve_m, strict=True))
        return PointOnCurve(name, t.body, x, y, z, tuple(t.at_m))
    if isinstance(t, schema.PrescribedPointTable):
        return PrescribedPoint(
            name, t.body, Constant(t.coordinate_m), tuple(t.at_m), tuple(t.along)
        )
    if isinstance(t, schema.PrescribedAngleTable):
        normals = tuple(t.normal_i), tuple(t.normal_j)
        angle = angle_from_deg(t.angle_deg)
        return PrescribedAngle(name, t.i, t.j, angle, tuple(t.axis_i), *normals)
    at = tuple(t.at_i_m), tuple(t.at_j_m)
    if isinstance(t, schema.FixedTable):
        e0 = np.sqrt(1.0 - np.dot(t.turn, t.turn))
        return Fixed(name, t.j, t.i, *at, (float(e0), *t.turn))
    joint, axes = _OF_AXES[t.type]
    return joint(name, t.i, t.j, *at, *(tuple(getattr(t, axis)) for axis in axes))


# Joints of two points, and the keys of the axes that they take.
_OF_AXES: dict[str, tuple[Callable[..., Joint], tuple[str, ...]]] = {
    "spherical": (Spherical, ()),
    "revolute": (Revolute, ("axis_i", "axis_j")),
    "point_on_line": (PointOnLine, ("axis_i",)),
    "prismatic": (Prismatic, ("axis_i", "axis_j", "normal_i", "normal_j")),
    "revolute_prismatic": (RevolutePrismatic, ("turn_axis_i", "turn_axis_j", "slide_axis_j")),
}


def _force(name: str, t: schema.ForceTable) -> Force:
    if isinstance(t, schema.PointForceTable | schema.AerodynamicForceTable):
        assert isinstance(t, schema.PointForceTable)  # those of the wind are kept apart
        return PointForce(name, t.body, tuple(t.force_N), tuple(t.at_m))
    ends = t.i, t.j, tuple(t.at_i_m), tuple(t.at_j_m)
    if isinstance(t, schema.SpringDamperTable):
        spring: float | Table = t.stiffness_N_per_m
        if t.pull_by_extension is not None:
            spring = _table(t.pull_by_extension, f"pull_by_extension of {name}")
        return SpringDamper(name, *ends, spring, t.free_length_m, t.damping_N_s_per_m)
    if isinstance(t, schema.BumpStopTable):
        longest = np.inf if t.longest_m is None else t.longest_m
        return BumpStop(name, *ends, t.shortest_m or 0.0, longest, t.stiffness_N_per_m)
    if t.force_N is not None:
        return Actuator(name, *ends, t.force_N)
    assert t.force_by_length is not None
    # A push that depends on the length is a spring without a free length, which pulls.
    pull = [[length, -push] for length, push in t.force_by_length]
    return SpringDamper(name, *ends, _table(pull, f"force_by_length of {name}"))


def _table(pairs: Sequence[Sequence[float]], what: str) -> Table:
    x, y = zip(*pairs, strict=True)
    return Table(x, y, what)
