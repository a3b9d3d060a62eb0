"""Mesh, time stepping, and the window of the line that moves with the train: tables."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from catenary.cases.scene.keys.table import (
    Table,
    either,
    given,
    not_with,
    take_away,
    together,
)
from catenary.solver.problem.integrator_parameters import (
    AVERAGE_ACCELERATION,
    HHT,
    LEAST_RADIUS_OF_HHT,
    NEWMARK,
)


class MeshTable(Table):
    """The finite-element mesh: made from the line, or the user's own."""

    elements_per_gap: int = Field(
        5, ge=1, le=128, description="elements between neighbouring droppers; 4 to 6 are usual"
    )
    support_refinement: int = Field(
        1, ge=1, le=16, description="factor by which the gaps next to supports are meshed finer"
    )
    grading: float = Field(
        1.0,
        ge=1,
        le=100,
        description="how many times longer elements are midway between neighbouring droppers than "
        "beside them, where wires bend over some centimetres; that of many elements: of eight to a "
        "gap 6 makes 4 times longer ones",
    )
    file: str | None = Field(
        None,
        min_length=1,
        description="own mesh (.msh) with the same groups, relative to the case file",
    )

    @model_validator(mode="after")
    def _consistent(self) -> MeshTable:
        ignored = self.model_fields_set & {"elements_per_gap", "support_refinement", "grading"}
        if self.file is not None and ignored:
            raise ValueError(f"takes file or {sorted(ignored)[0]}, but both are given{take_away()}")
        return self


# Statistics are taken below 20 Hz (EN 50317); its Nyquist limit is the longest step that can do so.
MAX_DT = 1.0 / 40.0
# Each halving has matrices and columns of its own.
MOST_DIVIDED = 4096


class NumericsTable(Table):
    """Time stepping."""

    dt_s: float = Field(1e-3, ge=1e-6, description="time step")
    scheme: Literal["one_solve", "fixed_point"] = Field(
        "one_solve", description="one solve a step, or the paper's fixed-point correction"
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
            raise not_with("coupling", f"with scheme {self.scheme}, but with one_solve only")
        if self.iterations is not None:
            if self.scheme != "fixed_point":
                raise not_with(
                    "iterations", f"with scheme {self.scheme}, but with fixed_point only"
                )
            if "max_iterations" in self.model_fields_set:
                raise ValueError(
                    f"takes iterations or max_iterations, but both are given{take_away()}"
                )
        if 2 * self.newmark_beta < self.newmark_gamma:
            raise ValueError(
                "must have 2 newmark_beta >= newmark_gamma to be stable for every step, but "
                f"newmark_beta is {self.newmark_beta:g} and newmark_gamma is {self.newmark_gamma:g}"
            )
        self._can_halve()
        self._has_its_spectral_radius()
        return self

    def _can_halve(self) -> None:
        smallest = self.smallest_dt_s
        if self.adaptive_tolerance_N is None:
            if smallest is not None:
                raise not_with("smallest_dt_s", "without adaptive_tolerance_N, which halves steps")
            return
        if smallest is not None and not self.dt_s / MOST_DIVIDED <= smallest <= 0.5 * self.dt_s:
            raise ValueError(
                f"must have smallest_dt_s from dt_s / {MOST_DIVIDED} to dt_s / 2, which is from "
                f"{self.dt_s / MOST_DIVIDED:g} to {0.5 * self.dt_s:g} s, not {smallest:g}"
            )

    def _has_its_spectral_radius(self) -> None:
        radius = self.spectral_radius
        own = (self.newmark_beta, self.newmark_gamma)
        if self.integrator == NEWMARK:
            if radius is not None:
                raise not_with(
                    "spectral_radius", "with integrator newmark, whose damping is newmark_gamma"
                )
            return
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
            raise not_with(
                "newmark_beta and newmark_gamma",
                f"with integrator {self.integrator}, whose parameters follow from spectral_radius",
            )

    @model_serializer(mode="wrap")
    def _acting(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """All keys that act; a table made of them is the same again."""
        plain: dict[str, Any] = handler(self)
        if self.iterations is not None:
            del plain["max_iterations"]
        return plain


_SPANS = ("spans_ahead", "spans_behind")


class WindowTable(Table):
    """Part of the line that moves."""

    mode: Literal["off", "exact", "bounded"] = Field(
        "off",
        description="off: all of the line moves; exact: whatever a wave has reached, to round-off; "
        "bounded: stations near the train, with an estimated error",
    )
    tolerance: float | None = Field(
        None,
        ge=1e-14,
        le=1e-2,
        description="mode bounded: stations rest whose motion is below this share of the largest",
    )
    spans_ahead: float | None = Field(
        None,
        ge=2,
        le=1e6,
        description="mode bounded: spans that move ahead of the first pantograph; chosen from "
        "damping and speed if this, spans_behind and tolerance are absent",
    )
    spans_behind: float | None = Field(
        None, ge=2, le=1e6, description="mode bounded: spans that move behind the last pantograph"
    )

    @model_validator(mode="after")
    def _fits_its_mode(self) -> WindowTable:
        there = given(self, "tolerance", *_SPANS)
        if self.mode != "bounded" and there:
            raise not_with(there[0], f"with mode {self.mode}, but with bounded only")
        for key in _SPANS:
            either(self, "tolerance", key)
        together(self, *_SPANS)
        return self
