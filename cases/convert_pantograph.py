"""From a scene's tables of pantographs to the data of their models, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from catenary.cases import schema_mechanism as schema
from catenary.cases.schema_head import StripsTable
from catenary.cases.schema_pantograph import MultibodyTable, PantographTable
from catenary.cases.units import angle_from_deg, speed_from_km_h
from catenary.mbs.bodies import Body
from catenary.mbs.build import PantographData
from catenary.mbs.forces import (
    Actuator,
    BumpStop,
    Force,
    Gravity,
    PointForce,
    SpringDamper,
    Table,
)
from catenary.mbs.joints import (
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
    constant,
)
from catenary.mbs.lumped import LumpedData
from catenary.mbs.multibody import AllBodies, MultibodyData, stand
from catenary.mbs.strips import Strips, Suspension, Turning
from catenary.mbs.system import System
from catenary.mbs.turning_round import turned_round


def pantograph_of(
    name: str, table: PantographTable, speed_km_h: float, *, reversed: bool = False
) -> PantographData:
    """The data of a pantograph's model under way with a speed, which may run the other way round.

    Raises
    ------
    InputError
        Published numbers of a multibody pantograph are not allowed.
    """
    if isinstance(table, MultibodyTable):
        data = multibody_of(name, table, speed_km_h)
        return replace(data, system=turned_round(data.system)) if reversed else data
    spring, damper = table.stiffnesses_N_per_m[0], table.dampings_N_s_per_m[0]
    roll = table.roll
    return LumpedData(
        tuple(table.masses_kg),
        tuple(table.stiffnesses_N_per_m),
        tuple(table.dampings_N_s_per_m),
        strips_of(table.strips, spring, damper),
        None
        if roll is None
        else _turning(roll.inertia_kg_m2, roll.spring_distance_m, spring, damper),
    )


def strips_of(table: StripsTable, spring: float = 0.0, damper: float = 0.0) -> Strips:
    """Strips of a head whose own spring [N/m] and damper [N s/m] also hold its pitch."""
    suspension = pitch = None
    if table.mass_kg is not None and table.stiffness_N_per_m is not None:
        suspension = Suspension(table.mass_kg, table.stiffness_N_per_m, table.damping_N_s_per_m)
    inertia, distance = table.pitch_inertia_kg_m2, table.pitch_spring_distance_m
    if inertia is not None and distance is not None:
        pitch = _turning(inertia, distance, spring, damper)
    return Strips(table.number, table.spacing_m or 0.0, table.length_m, suspension, pitch)


def _turning(inertia: float, distance: float, spring: float, damper: float) -> Turning:
    """A head on two halves of its spring and damper at a distance [m] from each other."""
    square = (0.5 * distance) ** 2
    return Turning(inertia, spring * square, damper * square)


def static_force(name: str, table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] at a speed, None if its table does not reach that speed.

    That of a multibody pantograph that is not calibrated follows from its mechanism.
    """
    if isinstance(table, MultibodyTable) and not table.calibrate:
        return stand(multibody_of(name, table, speed_km_h)).static_force
    return wanted_force(table, speed_km_h)


def wanted_force(table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] that a table asks for at a speed, None if it has none for it."""
    if table.static_force_N is not None:
        return table.static_force_N
    if table.static_force_by_speed is None:
        return None
    speeds, forces = np.array(table.static_force_by_speed).T
    if not speeds[0] <= speed_km_h <= speeds[-1]:
        return None
    return float(np.interp(speed_km_h, speeds, forces))


def multibody_of(name: str, table: MultibodyTable, speed_km_h: float) -> MultibodyData:
    """A multibody pantograph; forces of the wind are those at this speed."""
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
            name, t.body, constant(t.coordinate_m), tuple(t.at_m), tuple(t.along)
        )
    if isinstance(t, schema.PrescribedAngleTable):
        law = constant(angle_from_deg(t.angle_deg))
        normals = tuple(t.normal_i), tuple(t.normal_j)
        return PrescribedAngle(name, t.i, t.j, law, tuple(t.axis_i), *normals)
    at = tuple(t.at_i_m), tuple(t.at_j_m)
    if isinstance(t, schema.FixedTable):
        e0 = np.sqrt(1.0 - np.dot(t.turn, t.turn))
        return Fixed(name, t.j, t.i, *at, (float(e0), *t.turn))
    if isinstance(t, schema.SphericalTable):
        return Spherical(name, t.i, t.j, *at)
    if isinstance(t, schema.RevoluteTable):
        return Revolute(name, t.i, t.j, *at, tuple(t.axis_i), tuple(t.axis_j))
    if isinstance(t, schema.PointOnLineTable):
        return PointOnLine(name, t.i, t.j, *at, tuple(t.axis_i))
    if isinstance(t, schema.PrismaticTable):
        axes = (tuple(v) for v in (t.axis_i, t.axis_j, t.normal_i, t.normal_j))
        return Prismatic(name, t.i, t.j, *at, *axes)
    axes = (tuple(v) for v in (t.turn_axis_i, t.turn_axis_j, t.slide_axis_j))
    return RevolutePrismatic(name, t.i, t.j, *at, *axes)


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
