"""Scene tables of what a multibody pantograph is made of: bodies, joints, forces.

Points and directions are in the axes of the body that they belong to, those of "space" in space:
x along the track, y lateral, z up, from the pantograph's base. What depends on time is left out,
since the mechanism is reduced to tables over its height.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from catenary.cases.scene.keys.table import Table, ascending, ascending_pairs, either, exactly_one
from catenary.cases.scene.train.head import LEAST_INERTIA, LEAST_MASS
from catenary.mbs.rigid.bodies import SPACE

Coordinate = Annotated[float, Field(ge=-100, le=100)]
Point = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
ForceVector = Annotated[
    list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=3, max_length=3)
]
Name = Annotated[str, Field(min_length=1, max_length=100)]
_PAIR = Annotated[list[Annotated[float, Field(ge=-1e8, le=1e8)]], Field(min_length=2, max_length=2)]


def _has_length(axis: list[float]) -> list[float]:
    if not any(axis):
        raise ValueError("must not have zero length")
    return axis


def _at_most_one_long(turn: list[float]) -> list[float]:
    if math.hypot(*turn) > 1.0:
        raise ValueError("must be at most 1 long, so that there is an e0 to it")
    return turn


Axis = Annotated[Point, AfterValidator(_has_length)]
Turn = Annotated[Point, AfterValidator(_at_most_one_long)]
Pairs = Annotated[
    list[_PAIR], Field(min_length=2, max_length=1000), AfterValidator(ascending_pairs)
]  # a characteristic, straight between its points and beyond its ends
_X, _Y, _Z = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]
_ORIGIN = [0.0, 0.0, 0.0]


class BodyTable(Table):
    """A rigid body; its axes are principal axes of inertia through its centre of mass."""

    mass_kg: float = Field(ge=LEAST_MASS, le=10000, description="mass")
    inertia_kg_m2: Annotated[
        list[Annotated[float, Field(ge=LEAST_INERTIA, le=1e6)]], Field(min_length=3, max_length=3)
    ] = Field(description="moments of inertia about the body's axes")
    position_m: Point = Field(description="centre of mass at the start, joints roughly closed")
    turn: Turn = Field(_ORIGIN, description="Euler parameters e1, e2, e3 at the start")


class _Pair(Table):
    """Two bodies and a point on each."""

    i: Name = Field(SPACE, description=f"a body, or {SPACE}")
    j: Name = Field(description="another body")
    at_i_m: Point = Field(_ORIGIN, description="point on body i")
    at_j_m: Point = Field(_ORIGIN, description="point on body j")


class FixedTable(_Pair):
    """Body j is held by body i, or in space."""

    type: Literal["fixed"] = Field(description="kind of joint")
    turn: Turn = Field(_ORIGIN, description="e1, e2, e3 of body j as seen from body i")


class RevoluteTable(_Pair):
    """Bodies i and j turn about a common axis through a common point."""

    type: Literal["revolute"] = Field(description="kind of joint")
    axis_i: Axis = Field(_Y, description="axis of turning in body i")
    axis_j: Axis = Field(_Y, description="axis of turning in body j")


class SphericalTable(_Pair):
    """A point of body i is a point of body j."""

    type: Literal["spherical"] = Field(description="kind of joint")


class PrismaticTable(_Pair):
    """Body j slides along an axis of body i without turning."""

    type: Literal["prismatic"] = Field(description="kind of joint")
    axis_i: Axis = Field(_Z, description="axis of sliding in body i")
    axis_j: Axis = Field(_Z, description="axis of sliding in body j")
    normal_i: Axis = Field(_X, description="across the axis in body i")
    normal_j: Axis = Field(_X, description="across the axis in body j, pointing the same way")


class RevolutePrismaticTable(_Pair):
    """Body j slides along its own axis and turns about an axis of body i."""

    type: Literal["revolute_prismatic"] = Field(description="kind of joint")
    turn_axis_i: Axis = Field(_X, description="axis of turning in body i")
    turn_axis_j: Axis = Field(_X, description="the same axis in body j")
    slide_axis_j: Axis = Field(_Z, description="axis of sliding in body j")


class PointOnLineTable(_Pair):
    """A point of body j stays on a line fixed in body i."""

    type: Literal["point_on_line"] = Field(description="kind of joint")
    axis_i: Axis = Field(_X, description="direction of the line in body i")


class PointOnCurveTable(Table):
    """A point of a body stays on a curve in space."""

    type: Literal["point_on_curve"] = Field(description="kind of joint")
    body: Name = Field(description="a body")
    at_m: Point = Field(_ORIGIN, description="point on the body")
    curve_m: Annotated[list[Point], Field(min_length=2, max_length=1000)] = Field(
        description="points of the curve in space, x ascending, joined by cubic splines"
    )

    @model_validator(mode="after")
    def _along_x(self) -> PointOnCurveTable:
        ascending([point[0] for point in self.curve_m], "the x of curve_m")
        return self


class PrescribedPointTable(Table):
    """A point of a body has a prescribed coordinate along a direction in space."""

    type: Literal["prescribed_point"] = Field(description="kind of joint")
    body: Name = Field(description="a body")
    at_m: Point = Field(_ORIGIN, description="point on the body")
    along: Axis = Field(_Z, description="direction in space")
    coordinate_m: Coordinate = Field(description="coordinate along it")


class PrescribedAngleTable(Table):
    """Body j is turned by a prescribed angle about an axis of body i."""

    type: Literal["prescribed_angle"] = Field(description="kind of joint")
    i: Name = Field(SPACE, description=f"a body, or {SPACE}")
    j: Name = Field(description="another body")
    axis_i: Axis = Field(_Y, description="axis of turning in body i")
    normal_i: Axis = Field(_X, description="across the axis in body i")
    normal_j: Axis = Field(_X, description="along normal_i at the angle zero")
    angle_deg: float = Field(ge=-360, le=360, description="angle of turning")


JointTable = Annotated[
    FixedTable
    | RevoluteTable
    | SphericalTable
    | PrismaticTable
    | RevolutePrismaticTable
    | PointOnLineTable
    | PointOnCurveTable
    | PrescribedPointTable
    | PrescribedAngleTable,
    Field(discriminator="type"),
]


class SpringDamperTable(_Pair):
    """A spring and a damper side by side between two points."""

    type: Literal["spring_damper"] = Field(description="kind of force")
    stiffness_N_per_m: float = Field(0.0, ge=0, le=1e8, description="stiffness of a linear spring")
    pull_by_extension: Pairs | None = Field(
        None, description="pairs of extension [m] and pull [N], in place of a stiffness"
    )
    free_length_m: float = Field(0.0, ge=0, le=100, description="length without force")
    damping_N_s_per_m: float = Field(0.0, ge=0, le=1e7, description="linear damping")

    @model_validator(mode="after")
    def _one_spring(self) -> SpringDamperTable:
        either(self, "stiffness_N_per_m", "pull_by_extension")
        return self


class ActuatorTable(_Pair):
    """Pushes two points apart."""

    type: Literal["actuator"] = Field(description="kind of force")
    force_N: float | None = Field(
        None, ge=-1e7, le=1e7, description="constant force, > 0 pushing apart"
    )
    force_by_length: Pairs | None = Field(
        None, description="pairs of its length [m] and force [N], in place of a constant force"
    )

    @model_validator(mode="after")
    def _one_force(self) -> ActuatorTable:
        exactly_one(self, "force_N", "force_by_length")
        return self


class BumpStopTable(_Pair):
    """Keeps the distance of two points between two limits by springs that push only."""

    type: Literal["bump_stop"] = Field(description="kind of force")
    shortest_m: float | None = Field(None, gt=0, le=100, description="shortest distance")
    longest_m: float | None = Field(None, gt=0, le=100, description="longest distance")
    stiffness_N_per_m: float = Field(gt=0, le=1e8, description="stiffness of each stop")

    @model_validator(mode="after")
    def _a_limit(self) -> BumpStopTable:
        if self.shortest_m is None and self.longest_m is None:
            raise ValueError("must have shortest_m, longest_m or both")
        if None not in (self.shortest_m, self.longest_m) and self.shortest_m >= self.longest_m:  # type: ignore[operator]
            raise ValueError(
                f"must have shortest_m below longest_m, but they are {self.shortest_m:g} and "
                f"{self.longest_m:g}"
            )
        return self


class PointForceTable(Table):
    """A force on a point of a body, its direction fixed in space."""

    type: Literal["point_force"] = Field(description="kind of force")
    body: Name = Field(description="a body")
    at_m: Point = Field(_ORIGIN, description="point on the body")
    force_N: ForceVector = Field(description="force in space")


class AerodynamicForceTable(Table):
    """A force on a point of a body that grows with the square of the train's speed.

    The static force is what the pantograph exerts at standstill: this one comes on top of it.
    """

    type: Literal["aerodynamic_force"] = Field(description="kind of force")
    body: Name = Field(description="a body")
    at_m: Point = Field(_ORIGIN, description="point on the body")
    coefficient_N_s2_per_m2: Annotated[
        list[Annotated[float, Field(ge=-100, le=100)]], Field(min_length=3, max_length=3)
    ] = Field(description="force in space over the speed squared")


ForceTable = Annotated[
    SpringDamperTable | ActuatorTable | BumpStopTable | PointForceTable | AerodynamicForceTable,
    Field(discriminator="type"),
]
