"""The scene, everything a run is made of, as written in ``case.toml``; its line and problem in SI.

``load_scene`` is the one way in. A loaded scene is valid: types, bounds, geometry and effects
have been checked, so that what follows meets no surprise.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pydantic import Field, PrivateAttr

from catenary.cases.scene.input.case_files import value_at
from catenary.cases.scene.input.faults import Fault, Origin
from catenary.cases.scene.keys.keys import refusal
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.keys.units import speed_from_km_h
from catenary.cases.scene.line.hardware import fittings_of
from catenary.cases.scene.line.imperfections import (
    Defect,
    IrregularitiesTable,
    defects_of,
    irregularities_of,
)
from catenary.cases.scene.line.line import LineTable, ends_of, tunnels_of
from catenary.cases.scene.line.line_data import along_of, hanging_table, line_data
from catenary.cases.scene.run.case import CaseTable, EvaluationTable, OutputTable
from catenary.cases.scene.run.contact import ContactTable, contact_law_of
from catenary.cases.scene.run.incidents import Incident, line_incidents, lowering_of
from catenary.cases.scene.run.numerics import MeshTable, NumericsTable, PetscTable, WindowTable
from catenary.cases.scene.run.wind import WindTable, wind_of
from catenary.cases.scene.train.head import strips_of, turning_of
from catenary.cases.scene.train.laws import laws_of, regulation_of, uplift_of
from catenary.cases.scene.train.mechanism import Name
from catenary.cases.scene.train.pantograph import MultibodyTable, PantographTable, wanted_force
from catenary.cases.scene.train.train import TrainTable, VehicleTable, vehicle_of
from catenary.mbs.lumped import LumpedData
from catenary.mbs.vehicle import VehicleMotion
from catenary.meshgen.line import Line
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.postproc.standards.rule_books import book_named
from catenary.solver.effects import all_effects as effect_registry
from catenary.solver.effects.effect import Limit
from catenary.solver.problem.problem import (
    BOUNDED,
    Damping,
    Numerics,
    Placement,
    Problem,
    Train,
    WindowChoice,
)
from catenary.solver.window.choice import spans_of_window

if TYPE_CHECKING:
    from catenary.mbs.build import PantographData


class Scene(Table):
    """All tables of a case."""

    case: CaseTable = Field(default_factory=CaseTable, description="what the case is")
    line: LineTable = Field(description="the line from anchor to anchor")
    irregularities: IrregularitiesTable = Field(
        default_factory=IrregularitiesTable, description="what is irregular about the line"
    )
    defects: list[Defect] = Field(
        default_factory=list, max_length=10_000, description="what is wrong with the line"
    )
    mesh: MeshTable = Field(default_factory=MeshTable, description="the finite-element mesh")
    pantographs: dict[Name, PantographTable] = Field(
        min_length=1, max_length=100, description="the kinds of pantograph, by name"
    )
    train: TrainTable = Field(description="the train and its pantographs")
    vehicle: VehicleTable | None = Field(
        None, description="how the vehicle moves its pantographs' bases"
    )
    wind: WindTable | None = Field(None, description="wind over the line")
    contact: ContactTable = Field(
        default_factory=ContactTable, description="contact between head and wire"
    )
    numerics: NumericsTable = Field(default_factory=NumericsTable, description="time stepping")
    window: WindowTable = Field(
        default_factory=WindowTable, description="the part of the line that moves with the train"
    )
    evaluation: EvaluationTable = Field(description="the stretch whose statistics are judged")
    incidents: list[Incident] = Field(
        default_factory=list, max_length=1000, description="what happens during the run"
    )
    output: OutputTable = Field(default_factory=OutputTable, description="what is written")
    effects: dict[str, bool] = Field(
        default_factory=dict, description="what is simulated; see `catenary plan`"
    )
    petsc: PetscTable = Field(
        default_factory=PetscTable, description="PETSc's solver options; those after -- win"
    )
    test: dict[str, Any] = Field(
        default_factory=dict, description="keys and values that shorten the case for tests"
    )

    _origin: Origin = PrivateAttr(default=Origin("the scene"))

    @property
    def origin(self) -> Origin:
        """Origin of the keys, for sentences about them."""
        return self._origin

    @cached_property
    def line_data(self) -> LineData:
        """The line as topologies take it, made once: all checks look at it.

        Raises
        ------
        InputError
            If the droppers are not declared for one of the span lengths.
        """
        return line_data(self.line, self._origin)

    @cached_property
    def _tables(self) -> dict[str, Any]:
        """The scene as tables, made once: checks look values up by their keys."""
        return self.model_dump()

    def refused(self, key: str, why: str, *, value: object = None) -> Fault:
        """The fault of a key: its value, where it was written, and why it cannot be.

        ``value`` is a part of the key's value, if that part alone cannot be.
        """
        value = self._at(key) if value is None else value
        return refusal(self._origin, key, value, why, by_default=not self._is_given(key))

    def among(
        self, key: str, known: Collection[str], has: str = "", *, name: str | None = None
    ) -> Iterator[Fault]:
        """The fault of a key whose name is unknown.

        Parameters
        ----------
        key : dotted key whose value is the name
        known : allowed names
        has : words that introduce them in the sentence, such as their owner
        name : the name, if the key has several
        """
        name = str(self._at(key)) if name is None else name
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            meant = f"did you mean {near[0]}?" if near else ""
            names = ", ".join(known)
            why = f"{meant} {has} {names}".strip() if has else meant or f"it must be one of {names}"
            yield self.refused(key, why, value=name)

    def _at(self, key: str) -> object:
        """The value of a dotted key, which exists; of an effect whether it is on."""
        if key.startswith("effects."):
            return self.switches()[key.removeprefix("effects.")]
        return value_at(self._tables, key)

    def _is_given(self, key: str) -> bool:
        """Whether a dotted key is written somewhere, and has no default value."""
        here: Any = self
        for part in key.split("."):
            below = _written(here)
            if part not in below:
                return False
            here = below[part]
        return True

    def fault(self, key: str, sentence: str) -> Fault:
        """The fault of a key; ``sentence`` continues after the key's name and place."""
        return Fault(key, f"{key} {self._origin.of(key)} {sentence}")

    def missing(self, key: str, meaning: str, why: str = "", *, of: str = "") -> Fault:
        """The fault of a key that is not there; ``of`` is the table that is, ``why`` a sentence's
        end."""
        end = f": {why}" if why else ""
        named = f"{key} ({meaning})" if meaning else key
        return Fault(key, f"{named} is missing {self._origin.of(of or key)}{end}")

    def needs_effect(self, effect: str, *keys: str) -> Iterator[Fault]:
        """Faults of keys that act only with an effect that is off, unless the scene writes so."""
        if effect in self.effects or self.switches()[effect]:
            return
        why = f"acts only with effects.{effect} = true; write that, or false to leave it out"
        for key in keys:
            is_table = isinstance(self._at(key), dict)
            yield self.fault(key, why) if is_table else self.refused(key, f"it {why}")

    def switches(self) -> dict[str, bool]:
        """Every effect of the registry and whether it is on, in the registry's order."""
        return {
            name: effect.always or self.effects.get(name, effect.default)
            for name, effect in effect_registry.registry().items()
        }

    def holds(self, limit: Limit) -> bool:
        """Whether no effect that is on lifts a limit."""
        known, switches = effect_registry.registry(), self.switches()
        return not any(limit in known[name].lifts for name, on in switches.items() if on)


def _written(value: Any) -> dict[str, Any]:
    """What is written in a table or list, by keys or numbers."""
    if isinstance(value, Table):
        return {name: getattr(value, name) for name in value.model_fields_set}
    if isinstance(value, list | tuple):
        return {str(number): one for number, one in enumerate(value)}
    return value if isinstance(value, dict) else {}


def line_of(scene: Scene) -> Line:
    """The line of a scene.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths, or do not fit into one.
    """
    return replace(make_line(scene.line_data), fittings=fittings_of(scene.line.fittings))


def end_of(scene: Scene) -> float:
    """Place where the leading pantograph stops [m]: ``train.end_m`` or its default."""
    if scene.train.end_m is not None:
        return scene.train.end_m
    line = scene.line_data
    running_end = line.running_range[1]
    behind = max(placement.behind_m for placement in scene.train.pantographs)
    run_out = sum(line.span_lengths) / line.n_spans
    # The foremost strip must not leave the line either.
    running_end -= max(strips_ahead(scene))
    return float(min(running_end, scene.evaluation.to_m + behind + run_out))


def strips_ahead(scene: Scene) -> list[float]:
    """Distance of the outer strips of each pantograph from its middle, along the track [m]."""
    kinds = (scene.pantographs.get(place.name) for place in scene.train.pantographs)
    return [0.0 if kind is None else kind.strips.ahead for kind in kinds]


def resolved(scene: Scene) -> dict[str, Any]:
    """All keys with the values that hold, plain enough for JSON; loads to the same scene."""
    plain: dict[str, Any] = scene.model_dump(mode="json", exclude_none=True)
    plain["train"]["end_m"] = end_of(scene)
    plain["effects"] = scene.switches()
    judged = plain["evaluation"]
    judged.pop("edition", None)
    judged["rules"] = [book_named(name).key for name in scene.evaluation.chosen]
    if scene.mesh.file is not None:
        plain["mesh"] = {"file": scene.mesh.file}
    return plain


def problem_of(scene: Scene) -> Problem:
    """The problem of a scene."""
    numerics, train, line = scene.numerics, _train(scene), line_of(scene)
    hung = hanging_table(scene.line)
    problem = Problem(
        line=line,
        damping=_damping(scene.line),
        contact=contact_law_of(scene.contact, train.placements[0].static_force),
        train=train,
        numerics=Numerics(
            dt=numerics.dt_s,
            scheme=numerics.scheme,
            beta=numerics.newmark_beta,
            gamma=numerics.newmark_gamma,
            eps_d=numerics.eps_d_m,
            eps_v=numerics.eps_v_m_per_s,
            max_iterations=numerics.max_iterations,
            coupling=numerics.coupling or "implicit",
            eps_force=numerics.eps_force_N,
            integrator=numerics.integrator,
            spectral_radius=1.0 if numerics.spectral_radius is None else numerics.spectral_radius,
            iterations=numerics.iterations,
            adaptive_tolerance=numerics.adaptive_tolerance_N,
            smallest_dt=numerics.smallest_dt_s,
        ),
        evaluation=(scene.evaluation.from_m, scene.evaluation.to_m),
        residual_stiffness_ratio=0.0 if hung is None else hung.residual_stiffness_ratio,
        effects=frozenset(name for name, on in scene.switches().items() if on),
        incidents=line_incidents(scene.incidents, line, numerics.dt_s),
        slack_dampers_act=hung is not None and hung.slack_damping == "kept",
        ends=ends_of(scene.line.ends),
        tunnels=tunnels_of(scene.line.tunnels),
        wind=wind_of(scene.wind),
        along=along_of(scene.line),
        irregularities=irregularities_of(scene.irregularities, line),
        defects=defects_of(scene.defects, line),
    )
    return replace(problem, window=_window(scene.window, problem))


def _window(table: WindowTable, problem: Problem) -> WindowChoice:
    if table.mode == BOUNDED and table.tolerance is None:
        return spans_of_window(problem, table.spans_ahead, table.spans_behind)
    return WindowChoice(table.mode, table.tolerance)


def _damping(table: LineTable) -> Damping:
    lateral = table.damping.lateral
    return Damping(
        alpha=table.damping.alpha_s,
        beta=table.damping.beta_per_s,
        per_component={
            name: (value.alpha_s, value.beta_per_s)
            for name, value in table.damping.per_component.items()
        },
        lateral=None if lateral is None else (lateral.alpha_s, lateral.beta_per_s),
    )


def _vehicle(scene: Scene) -> VehicleMotion | None:
    if scene.vehicle is None:
        return None
    vehicle = vehicle_of(scene.vehicle)
    # A suspension passes on the motion of the track only.
    return vehicle if scene.switches()["vehicle_motion"] else replace(vehicle, suspension=None)


def _train(scene: Scene) -> Train:
    placements = []
    for number, place in enumerate(scene.train.pantographs, start=1):
        kind = scene.pantographs[place.name]
        force = static_force(place.name, kind, scene.train.speed_km_h)
        assert force is not None  # ``check_pantographs`` has refused speeds outside the table
        placements.append(
            Placement(
                data=pantograph_of(
                    place.name, kind, scene.train.speed_km_h, reversed=place.reversed
                ),
                static_force=force,
                behind=place.behind_m,
                nominal_height=kind.nominal_height_m,
                lowering=lowering_of(scene.incidents, number, scene.numerics.dt_s),
                regulator=regulation_of(kind.regulation),
            )
        )
    return Train(
        speed=speed_from_km_h(scene.train.speed_km_h),
        start=scene.train.start_m,
        end=end_of(scene),
        raise_time=scene.train.raise_time_s,
        start_below=scene.train.start_below_m,
        placements=tuple(placements),
        vehicle=_vehicle(scene),
    )


def pantograph_of(
    name: str, table: PantographTable, speed_km_h: float, *, reversed: bool = False
) -> PantographData:
    """The data of a pantograph's model at a train speed.

    Parameters
    ----------
    name : of the pantograph, for messages
    table : its table in the scene
    speed_km_h : train speed [km/h], for aerodynamic forces
    reversed : whether it runs the other way round

    Raises
    ------
    InputError
        If the data of a multibody pantograph are not allowed.
    """
    if isinstance(table, MultibodyTable):
        from catenary.cases.scene.train.multibody import multibody_of, turned

        data = replace(
            multibody_of(name, table, speed_km_h),
            uplift=uplift_of(table.aerodynamics, reversed),
            laws=laws_of(table.laws, 2),
            crosswind_factor=table.crosswind_factor,
        )
        return turned(data) if reversed else data
    spring, damper = table.stiffnesses_N_per_m[0], table.dampings_N_s_per_m[0]
    roll = table.roll
    return LumpedData(
        tuple(table.masses_kg),
        tuple(table.stiffnesses_N_per_m),
        tuple(table.dampings_N_s_per_m),
        strips_of(table.strips, spring, damper),
        None
        if roll is None
        else turning_of(roll.inertia_kg_m2, roll.spring_distance_m, spring, damper),
        uplift_of(table.aerodynamics, reversed),
        laws_of(table.laws, len(table.masses_kg)),
        table.crosswind_factor,
    )


def static_force(name: str, table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] at a speed, None if its table does not reach that speed.

    That of a multibody pantograph that is not calibrated follows from its mechanism.
    """
    if isinstance(table, MultibodyTable) and not table.calibrate:
        from catenary.cases.scene.train.multibody import multibody_of
        from catenary.mbs.mechanism.multibody_pantograph import stand

        return stand(multibody_of(name, table, speed_km_h)).static_force
    return wanted_force(table, speed_km_h)
