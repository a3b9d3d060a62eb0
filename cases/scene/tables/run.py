"""Scene tables of what runs on the line: train, pantographs, contact, numerics, evaluation."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from catenary.cases.scene.tables.table import TAKE_AWAY, Table
from catenary.postproc.record.blocks import OTHER_PARTS
from catenary.postproc.record.field_kinds import FIELDS, USUAL_FIELDS
from catenary.solver.problem.integrator_parameters import (
    AVERAGE_ACCELERATION,
    HHT,
    LEAST_RADIUS_OF_HHT,
    NEWMARK,
)
from catenary.solver.time_loop.channels import line_channels

# Channels of the line, which may be recorded in part.
_RECORDED = line_channels()
_FIELDS = FIELDS

# Statistics are taken below 20 Hz (EN 50317); its Nyquist limit is the longest step that can do so.
MAX_DT = 1.0 / 40.0
# Each halving has matrices and columns of its own.
MOST_DIVIDED = 4096


class CaseTable(Table):
    """What the case is."""

    name: str = Field("", max_length=200, description="name; the folder's if absent")
    title: str = Field("", max_length=500, description="one line for lists and reports")
    description: str = Field("", max_length=20000, description="problem and set-up")
    source: str = Field("", max_length=2000, description="where the data come from")


class PlacementTable(Table):
    """A pantograph on the train."""

    name: str = Field(min_length=1, description="which table of [pantographs] it is")
    behind_m: float = Field(
        0.0, ge=0, le=1000, description="distance behind the leading pantograph"
    )
    reversed: bool = Field(
        False,
        description="whether a multibody pantograph runs the other way round: its x points back",
    )


class TrainTable(Table):
    """The train: one speed, one or more pantographs."""

    speed_km_h: float = Field(ge=1, le=1000, description="train speed")
    start_m: float = Field(
        ge=0, le=1e6, description="position of the leading pantograph at the start"
    )
    end_m: float | None = Field(
        None,
        ge=0,
        le=1e6,
        description="position of the leading pantograph at the end; one span after the trailing "
        "one has left the evaluated stretch if absent",
    )
    raise_time_s: float = Field(
        0.5, ge=0, le=60, description="time in which the static force grows from zero"
    )
    start_below_m: float = Field(
        0.0,
        ge=0,
        le=5,
        description="how far below the wire at rest all heads start, so that they are raised",
    )
    pantographs: list[PlacementTable] = Field(
        min_length=1, max_length=16, description="pantographs in running order, leading one first"
    )


class NumericsTable(Table):
    """Time stepping."""

    dt_s: float = Field(1e-3, ge=1e-6, description="time step")
    scheme: Literal["one_solve", "fixed_point", "ts_alpha2"] = Field(
        "one_solve",
        description="one solve a step, the paper's fixed-point correction, or PETSc's TSALPHA2 on "
        "line and pantographs as one system",
    )
    coupling: Literal["implicit", "iterated", "explicit"] | None = Field(
        None,
        description="one_solve: contact forces implicit through both sides (if absent), exchanged "
        "until they agree, or from the extrapolated motion of both sides",
    )
    integrator: Literal["newmark", "hht", "generalized_alpha"] = Field(
        "newmark", description="method that advances the line"
    )
    spectral_radius: float | None = Field(
        None,
        ge=0,
        le=1,
        description="integrators hht (0.5 to 1) and generalized_alpha: what is left of the fastest "
        "vibrations after a step",
    )
    newmark_beta: float = Field(0.25, gt=0, le=1, description="Newmark's beta")
    newmark_gamma: float = Field(0.5, ge=0.5, le=2, description="Newmark's gamma")
    eps_d_m: float = Field(
        1e-6, gt=0, le=1e-2, description="fixed_point: change of displacement that ends a step"
    )
    eps_v_m_per_s: float = Field(
        1e-3, gt=0, le=1, description="fixed_point: change of velocity that ends a step"
    )
    eps_force_N: float = Field(
        1e-6, gt=0, le=10, description="coupling iterated: change of force that ends a step"
    )
    max_iterations: int = Field(
        50,
        ge=1,
        le=10000,
        description="most corrections (fixed_point) or exchanges (coupling iterated) a step",
    )
    iterations: int | None = Field(
        None,
        ge=1,
        le=10000,
        description="fixed_point: corrections of every step, after which it goes on whatever they "
        "reached; until changes are below eps_d_m and eps_v_m_per_s if absent",
    )

    adaptive_tolerance_N: float | None = Field(
        None,
        gt=0,
        le=1e6,
        description="error of a contact force accepted in one step: steps with a larger one, or "
        "without a solution, are halved, while the record keeps dt_s; none are halved if absent",
    )
    smallest_dt_s: float | None = Field(
        None,
        ge=1e-7,
        description="adaptive_tolerance_N: step below which none is halved; a 32nd of dt_s if "
        "absent",
    )

    @field_validator("dt_s")
    @classmethod
    def _resolves_20_hz(cls, dt: float) -> float:
        if dt > MAX_DT:
            raise ValueError(f"must be at most {MAX_DT} s, so that 20 Hz are resolved")
        return dt

    @model_validator(mode="after")
    def _stable(self) -> NumericsTable:
        if self.coupling is not None and self.scheme != "one_solve":
            raise ValueError(
                f"must not give coupling, which belongs to scheme one_solve, with {self.scheme}"
                + TAKE_AWAY
            )
        if self.iterations is not None:
            if self.scheme != "fixed_point":
                raise ValueError(
                    "must not give iterations, which belongs to scheme fixed_point, with "
                    f"{self.scheme}{TAKE_AWAY}"
                )
            if "max_iterations" in self.model_fields_set:
                raise ValueError(
                    f"takes iterations or max_iterations, but both are given{TAKE_AWAY}"
                )
        if 2 * self.newmark_beta < self.newmark_gamma:
            raise ValueError(
                "must have 2 newmark_beta >= newmark_gamma to be stable for every step, but "
                f"newmark_beta is {self.newmark_beta:g} and newmark_gamma is {self.newmark_gamma:g}"
            )
        return self

    @model_validator(mode="after")
    def _can_halve(self) -> NumericsTable:
        smallest = self.smallest_dt_s
        if self.adaptive_tolerance_N is None:
            if smallest is not None:
                raise ValueError(
                    "must not give smallest_dt_s without adaptive_tolerance_N, which halves steps"
                    + TAKE_AWAY
                )
            return self
        if self.scheme == "ts_alpha2":
            raise ValueError(
                "must not give adaptive_tolerance_N with scheme ts_alpha2, in which PETSc keeps a "
                "part of the state to itself, so that no step can be repeated" + TAKE_AWAY
            )
        if smallest is not None and not self.dt_s / MOST_DIVIDED <= smallest <= 0.5 * self.dt_s:
            raise ValueError(
                f"must have smallest_dt_s from dt_s / {MOST_DIVIDED} to dt_s / 2, which is from "
                f"{self.dt_s / MOST_DIVIDED:g} to {0.5 * self.dt_s:g} s, not {smallest:g}"
            )
        return self

    @model_validator(mode="after")
    def _has_its_spectral_radius(self) -> NumericsTable:
        radius = self.spectral_radius
        own = (self.newmark_beta, self.newmark_gamma)
        if self.scheme == "ts_alpha2" and own != AVERAGE_ACCELERATION[:2]:
            raise ValueError(
                "must not give newmark_beta and newmark_gamma with scheme ts_alpha2, which takes "
                "average acceleration, or integrators hht and generalized_alpha by their "
                "spectral_radius" + TAKE_AWAY
            )
        if self.integrator == NEWMARK:
            if radius is not None:
                raise ValueError(
                    "must not give spectral_radius, which belongs to integrators hht and "
                    "generalized_alpha, with newmark, whose damping is newmark_gamma" + TAKE_AWAY
                )
            return self
        if radius is None:
            raise ValueError(
                f"must give spectral_radius with integrator {self.integrator}, for instance 0.8"
            )
        if self.integrator == HHT and radius < LEAST_RADIUS_OF_HHT:
            raise ValueError(
                f"must have spectral_radius from {LEAST_RADIUS_OF_HHT:g} to 1 with integrator hht, "
                f"not {radius:g}: take generalized_alpha for less"
            )
        if own != AVERAGE_ACCELERATION[:2]:
            raise ValueError(
                "must not give newmark_beta and newmark_gamma, which belong to integrator newmark, "
                f"with {self.integrator}, whose parameters follow from spectral_radius" + TAKE_AWAY
            )
        return self

    @model_serializer(mode="wrap")
    def _acting(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """All keys that act; a table made of them is the same again."""
        plain: dict[str, Any] = handler(self)
        if self.iterations is not None:
            del plain["max_iterations"]
        return plain


def _year(value: Any) -> Any:
    """An edition is named by a year, which one writes as a number too."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class EvaluationTable(Table):
    """The stretch whose statistics are judged, and by what."""

    from_m: float = Field(ge=0, le=1e6, description="start of the evaluated stretch")
    to_m: float = Field(gt=0, le=1e6, description="end of the evaluated stretch")
    edition: Annotated[str, BeforeValidator(_year)] = Field(
        "2006", description="edition of EN 50367 whose limits are applied"
    )
    system: str = Field("ac", description="power supply, which decides the mean force allowed")

    @model_validator(mode="after")
    def _consistent(self) -> EvaluationTable:
        if self.to_m <= self.from_m:
            raise ValueError(
                f"must end after it starts, but from_m is {self.from_m:g} and to_m {self.to_m:g}"
            )
        return self


class OutputTable(Table):
    """What is written, and how much of it."""

    field_every_s: float | None = Field(
        None,
        ge=0,
        le=1e4,
        description="cadence of field snapshots; 0 writes none; 0.05 s if absent, or as much "
        "longer as keeps them within 500 MB",
    )
    field_every_m: float | None = Field(
        None, gt=0, le=1e4, description="the same as a distance that the train travels"
    )
    fields: list[Literal[_FIELDS]] | None = Field(  # type: ignore[valid-type]
        None,
        min_length=1,
        max_length=len(_FIELDS),
        description=f"fields of the snapshots, of {' and '.join(_FIELDS)}; "
        f"{' and '.join(USUAL_FIELDS)} if absent",
    )
    field_parts: list[Annotated[str, Field(min_length=1, max_length=100)]] | None = Field(
        None,
        min_length=1,
        max_length=100,
        description="parts of the line that snapshots show: names of wires, and "
        f"{', '.join(OTHER_PARTS)}; all if absent",
    )
    field_spans: list[Annotated[int, Field(ge=1, le=10**6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="first and last span that snapshots show, counted from 1; all if absent",
    )
    field_window_m: list[Annotated[float, Field(ge=0, le=1e6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="how far behind the last and ahead of the first pantograph snapshots show the "
        "line; the whole line if absent",
    )
    energy_every_s: float = Field(
        0.05, ge=0, le=1e4, description="cadence of the line's energy; 0 writes none"
    )
    flush_every_steps: int | None = Field(
        None,
        ge=1,
        le=10**7,
        description="steps after which the result file is brought up to date; about half a "
        "second's worth if absent",
    )
    line_channels: list[Literal[_RECORDED]] | None = Field(  # type: ignore[valid-type]
        None,
        max_length=len(_RECORDED),
        description=f"channels of the line that are recorded, of {' and '.join(_RECORDED)}; "
        "all if absent. Their extremes are kept of every step, whatever is recorded",
    )
    line_channels_every_s: float | None = Field(
        None,
        ge=0,
        le=1e4,
        description="cadence of the line's channels; 0 records every step. Of this key and the "
        "next four none: every step up to 500 MB, beyond it every 5 ms from 300 m behind to 200 m "
        "ahead of the train",
    )
    line_channels_every_m: float | None = Field(
        None, ge=0, le=1e4, description="the same as a distance that the train travels"
    )
    line_channels_window_m: list[Annotated[float, Field(ge=0, le=1e6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="how far behind the last and ahead of the first pantograph the line's channels "
        "are recorded; the whole line if absent",
    )
    line_channels_spans: list[Annotated[int, Field(ge=1, le=10**6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="first and last span whose channels are recorded, counted from 1; all if "
        "absent",
    )
    line_channels_compression: Literal["none", "gzip"] | None = Field(
        None,
        description="compression of the line's channels; gzip where their size has thinned them, "
        "none otherwise, if absent",
    )

    @property
    def chooses_line_channels(self) -> bool:
        """Whether the scene says what is recorded of the line's channels."""
        own = (
            self.line_channels,
            self.line_channels_every_s,
            self.line_channels_every_m,
            self.line_channels_window_m,
            self.line_channels_spans,
        )
        return any(value is not None for value in own)

    @model_validator(mode="after")
    def _can_be_recorded(self) -> OutputTable:
        if self.line_channels_every_s is not None and self.line_channels_every_m is not None:
            raise ValueError(
                "takes line_channels_every_s or line_channels_every_m, but both are given"
                + TAKE_AWAY
            )
        if self.field_every_s is not None and self.field_every_m is not None:
            raise ValueError("takes field_every_s or field_every_m, but both are given" + TAKE_AWAY)
        for key in ("line_channels_spans", "field_spans"):
            spans = getattr(self, key)
            if spans is not None and spans[0] > spans[1]:
                raise ValueError(
                    f"must have {key} from a span to a later one, not {spans[0]} to {spans[1]}"
                )
        return self
