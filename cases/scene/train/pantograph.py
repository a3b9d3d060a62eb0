"""Kinds of pantograph: tables, and conversion to the data of their models in SI."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationError,
    model_serializer,
    model_validator,
)

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import assign, value_at
from catenary.cases.scene.keys.table import Table, ascending, exactly_one, given, not_with
from catenary.cases.scene.train.head import LEAST_MASS, RollTable, StripsTable
from catenary.cases.scene.train.laws import AerodynamicsTable, LawTable, RegulationTable
from catenary.cases.scene.train.mechanism import BodyTable, ForceTable, JointTable, Name
from catenary.mbs.lumped import READY

Mass = Annotated[float, Field(ge=LEAST_MASS, le=1000)]
Stiffness = Annotated[float, Field(ge=0, le=1e8)]
DampingValue = Annotated[float, Field(ge=0, le=1e6)]
# Names of ready chains, and the lists that stand for one.
Ready = Literal["en50318_2002", "en50318_2018", "dsa380", "ambrosio2012"]
CHAIN = ("masses_kg", "stiffnesses_N_per_m", "dampings_N_s_per_m")
# Keys that act only if all bodies are moved.
_OF_ALL_BODIES = ("constraint_handling", "substeps")


class _Pressing(Table):
    """Force and place at which a pantograph presses at rest."""

    static_force_N: float | None = Field(None, gt=0, le=1000, description="static contact force")
    static_force_by_speed: (
        list[Annotated[list[float], Field(min_length=2, max_length=2)]] | None
    ) = Field(
        None,
        min_length=1,
        max_length=1000,
        description="pairs of speed [km/h] and force [N], linear in between",
    )
    nominal_height_m: float | None = Field(
        None, gt=0, le=20, description="head height at which the static force holds"
    )
    strips: StripsTable = Field(default_factory=StripsTable, description="collector strips")
    aerodynamics: AerodynamicsTable | None = Field(
        None, description="uplift by the air under way, on top of the static force"
    )
    crosswind_factor: float = Field(
        0.0,
        ge=0,
        le=2,
        description="factor of the squared wind across the track in the squared speed of the air; "
        "acts with aerodynamics or an aerodynamic_force",
    )
    laws: list[LawTable] = Field(
        default_factory=list, max_length=20, description="what is not linear between its masses"
    )
    regulation: RegulationTable | None = Field(
        None, description="a controller that changes the static force under way"
    )

    @model_validator(mode="after")
    def _forces_by_speed(self) -> _Pressing:
        if self.static_force_by_speed is not None:
            ascending([pair[0] for pair in self.static_force_by_speed],
                      "the speeds of static_force_by_speed")  # fmt: skip
            for speed, force in self.static_force_by_speed:
                if not 0 <= speed <= 1000:
                    raise ValueError(
                        "must have speeds between 0 and 1000 km/h in static_force_by_speed, but "
                        f"one is {speed:g}"
                    )
                if not 0 < force <= 1000:
                    raise ValueError(
                        "must have forces between 0 and 1000 N in static_force_by_speed, "
                        f"but one is {force:g}"
                    )
        return self


class LumpedTable(_Pressing):
    """A pantograph as a chain of lumped masses, head first; the last spring stands on the base."""

    type: Literal["lumped"] = Field("lumped", description="model: lumped or multibody")
    model: Ready | None = Field(
        None, description="a ready chain in place of the three lists; see `list --pantographs`"
    )
    masses_kg: list[Mass] = Field(
        min_length=1,
        max_length=20,
        description="masses, head first; those of model, if it is given",
    )
    stiffnesses_N_per_m: list[Stiffness] = Field(
        description="springs below each mass, the last one to the base; only that may be 0"
    )
    dampings_N_s_per_m: list[DampingValue] = Field(description="dampers below each mass")
    roll: RollTable | None = Field(
        None, description="how the head rolls; acts with effects.head_roll"
    )

    @model_validator(mode="before")
    @classmethod
    def _take_ready(cls, raw: Any) -> Any:
        """The lists of a ready chain; lists beside its name must be the same."""
        model = raw.get("model") if isinstance(raw, dict) else None
        if not isinstance(model, str):
            return raw
        # Of an unknown name that alone is said, not that lists are missing.
        ready = READY.get(model, next(iter(READY.values()))).chain
        filled = dict(raw)
        for key, values in zip(CHAIN, (ready.masses, ready.stiffnesses, ready.dampings),
                               strict=True):  # fmt: skip
            if filled.setdefault(key, list(values)) != list(values) and model in READY:
                raise not_with(key, f'beside model = "{model}", which has its own')
        return filled

    @model_validator(mode="after")
    def _consistent(self) -> LumpedTable:
        n = len(self.masses_kg)
        for name in ("stiffnesses_N_per_m", "dampings_N_s_per_m"):
            if len(getattr(self, name)) != n:
                raise ValueError(
                    f"must give one value per mass, but {name} has {len(getattr(self, name))} "
                    f"and masses_kg has {n}"
                )
        if any(k == 0 for k in self.stiffnesses_N_per_m[:-1]):
            raise ValueError("must have springs between its masses: only the last of "
                             "stiffnesses_N_per_m may be 0")  # fmt: skip
        own = self.static_force_N is not None or self.static_force_by_speed is not None
        if own or self.model is None or READY[self.model].static_force is None:
            exactly_one(self, "static_force_N", "static_force_by_speed")
        elif any(READY[self.model].uplift) and self.aerodynamics is not None:
            raise ValueError(
                f'must have static_force_N beside aerodynamics: the force of "{self.model}" '
                "holds the uplift of its source"
            )
        if self.strips.mass >= self.masses_kg[0]:
            raise ValueError(
                f"must have a head heavier than its strips, but masses_kg gives it "
                f"{self.masses_kg[0]:g} kg and strips.mass_kg gives them {self.strips.mass:g} kg"
            )
        turns = self.roll is not None or self.strips.pitch_inertia_kg_m2 is not None
        if turns and n == 1:
            raise ValueError("needs a mass below a head that rolls or pitches")
        return self


class CorrectionTable(Table):
    """A published number that cannot be meant; the corrected one stands where ``key`` says."""

    key: str = Field(min_length=1, max_length=200, description="which number of the pantograph")
    published: float = Field(ge=-1e8, le=1e8, description="what the source gives in its place")
    reason: str = Field(min_length=1, max_length=2000, description="why it cannot be meant")


class MultibodyTable(_Pressing):
    """A pantograph as a mechanism of rigid bodies that raises a head on springs."""

    type: Literal["multibody"] = Field(description="model: lumped or multibody")
    head: Name = Field(description="the body that touches the wire")
    arm: Name = Field(description="the body that carries the head; its height is the raising")
    actuator: Name | None = Field(None, description="the force that is calibrated")
    calibrate: bool = Field(
        True,
        description="find the actuator's force from the static force; false: the other way round",
    )
    working_height_m: float | None = Field(
        None,
        ge=-20,
        le=20,
        description="arm above base at the static force; as assembled if absent",
    )
    assembly_tolerance_m: float = Field(
        0.05, gt=0, le=1, description="largest closure error of a joint in the given positions"
    )
    gravity: bool = Field(True, description="whether the bodies weigh something")
    motion: Literal["reduced", "all_bodies"] = Field(
        "reduced",
        description="in the time loop: the mechanism as tables over the arm's height, or all "
        "bodies with their joints, which makes a run several times longer",
    )
    constraint_handling: Literal["coordinate_partitioning", "augmented_lagrangian", "baumgarte"] = (
        Field(
            "coordinate_partitioning", description="how joints are kept, with motion = all_bodies"
        )
    )
    substeps: int = Field(
        1, ge=1, le=100, description="of a step of the line, with motion = all_bodies"
    )
    as_published: bool = Field(False, description="take the published numbers of the corrections")
    bodies: dict[str, BodyTable] = Field(min_length=2, max_length=100, description="rigid bodies")
    joints: dict[str, JointTable] = Field(min_length=1, max_length=100, description="joints")
    forces: dict[str, ForceTable] = Field(
        min_length=1, max_length=100, description="forces besides gravity"
    )
    corrections: list[CorrectionTable] = Field(
        default_factory=list, max_length=100, description="numbers that differ from the source"
    )

    @model_validator(mode="after")
    def _consistent(self) -> MultibodyTable:
        forces = ("static_force_N", "static_force_by_speed")
        if self.calibrate:
            exactly_one(self, *forces)
            if self.actuator is None:
                raise ValueError(
                    "needs actuator, the force to be calibrated, unless calibrate is false"
                )
        elif there := given(self, *forces):
            raise not_with(
                there[0],
                "with calibrate = false, because the static force follows from the actuator",
            )
        if self.strips.pitch_inertia_kg_m2 is not None:
            raise not_with(
                "strips.pitch_inertia_kg_m2",
                "because the pitch of its head follows from bodies, joints and forces",
            )
        if self.strips.rake_deg:
            raise not_with(
                "strips.rake_deg",
                "because its head is pressed where a strip that is square to the track is",
            )
        if self.motion == "all_bodies" and self.strips.mass_kg is not None:
            raise not_with(
                "strips.mass_kg",
                "with motion = all_bodies, because strips on springs of their own are no bodies",
            )
        for key in _OF_ALL_BODIES:
            if self.motion == "reduced" and key in self.model_fields_set:
                raise not_with(
                    key,
                    "with motion = reduced, because it acts only with motion = all_bodies",
                )
        plain = self.model_dump() if self.corrections else {}
        for key in (correction.key for correction in self.corrections):
            value = value_at(plain, key)
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ValueError(
                    f"must name numbers of this pantograph in its corrections, but {key} is none"
                )
        if self.as_published and not self.corrections:
            raise ValueError("must list corrections if as_published is true")
        return self

    @model_serializer(mode="wrap")
    def _acting(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """All keys that act; a table made of them is the same again."""
        plain: dict[str, Any] = handler(self)
        idle = _OF_ALL_BODIES if self.motion == "reduced" else ()
        return {key: value for key, value in plain.items() if key not in idle}

    def in_force(self) -> MultibodyTable:
        """Return this table with the published numbers in place, if ``as_published``.

        Raises
        ------
        InputError
            A published number is not allowed where it stands.
        """
        if not self.as_published:
            return self
        raw = self.model_dump(exclude_none=True, exclude={"corrections", "as_published"})
        for correction in self.corrections:
            assign(raw, correction.key, correction.published)
        try:
            return MultibodyTable.model_validate(raw)
        except ValidationError as failed:
            first = failed.errors()[0]
            key = ".".join(str(part) for part in first["loc"])
            raise InputError(f"the published {key} is not allowed: {first['msg']}") from failed


def _kind(raw: Any) -> Any:
    """Kind of a pantograph's table: that of its type, lumped if it has none."""
    if isinstance(raw, dict):
        return raw.get("type", "lumped")
    return getattr(raw, "type", "lumped")


PantographTable = Annotated[
    Annotated[LumpedTable, Tag("lumped")] | Annotated[MultibodyTable, Tag("multibody")],
    Discriminator(_kind),
]


def wanted_force(table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] of a table at a speed, None if it has none for it."""
    if table.static_force_N is not None:
        return table.static_force_N
    if table.static_force_by_speed is None:
        ready = None if isinstance(table, MultibodyTable) else table.model
        return None if ready is None else READY[ready].force_at(speed_km_h)
    speeds, forces = np.array(table.static_force_by_speed).T
    if not speeds[0] <= speed_km_h <= speeds[-1]:
        return None
    return float(np.interp(speed_km_h, speeds, forces))
