"""Mesh, time stepping, the window that moves with the train, and PETSc's solver: tables.

A scene is data that may come from a stranger, while PETSc's options run programs, load libraries
and write files. So each option that a scene may give is a field here, with its kind and its
bounds: no viewer, no monitor, no path, no option that takes free text. All others are the user's
own and stand on the command line, after ``--``.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

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


# Words and bounds of the options that a solver has, the one of all ranks and the one on each rank.
_Ksp = Literal["preonly", "richardson", "cg", "minres", "gmres", "fgmres", "bcgs"] | None
_Norm = Literal["none", "preconditioned", "unpreconditioned", "natural"] | None
_Local = Literal["none", "jacobi", "sor", "icc", "ilu", "cholesky", "lu"] | None
_Pc = Literal["none", "jacobi", "bjacobi", "asm", "sor", "icc", "ilu", "cholesky", "lu"] | None
_Ordering = Literal["natural", "nd", "1wd", "rcm", "qmd"] | None
_Package = Literal["petsc", "mumps"] | None
_Shift = Literal["none", "inblocks"] | None
_Asm = Literal["basic", "restrict", "interpolate", "none"] | None
_Tolerance = Annotated[float | None, Field(gt=0, le=1e-3)]
_Iterations = Annotated[int | None, Field(ge=1, le=100_000)]
_Levels = Annotated[int | None, Field(ge=0, le=20)]
_Fill = Annotated[float | None, Field(ge=1, le=100)]


def _option(description: str, **bounds: Any) -> Any:
    return Field(None, description=description, **bounds)


def _on_rank(description: str) -> Any:
    return _option(f"{description} on each rank")


_KSP, _RTOL, _MAX_IT = "Krylov method", "relative tolerance", "most iterations"
_ORDER, _PACKAGE = "order of the unknowns in a factorisation", "package that factorises"
_LEVELS, _FILL = "levels of fill of icc and ilu", "expected fill of a factorisation"
_SHIFT = "what is added to small pivots"


class PetscTable(Table):
    """PETSc's solver of the line; an option's name here is PETSc's without its dash."""

    march_ksp_type: _Ksp = _option(_KSP)
    march_ksp_rtol: _Tolerance = _option(_RTOL)
    march_ksp_atol: float | None = _option("absolute tolerance", ge=0, le=1)
    march_ksp_divtol: float | None = _option(
        "growth of the residual that is taken for divergence", ge=10, le=1e12
    )
    march_ksp_max_it: _Iterations = _option(_MAX_IT)
    march_ksp_norm_type: _Norm = _option("norm that is tested")
    march_ksp_gmres_restart: int | None = _option("directions that GMRES keeps", ge=1, le=1000)
    march_pc_type: _Pc = _option("preconditioner or direct solver")
    march_pc_factor_mat_ordering_type: _Ordering = _option(_ORDER)
    march_pc_factor_mat_solver_type: _Package = _option(_PACKAGE)
    march_pc_factor_levels: _Levels = _option(_LEVELS)
    march_pc_factor_fill: _Fill = _option(_FILL)
    march_pc_factor_shift_type: _Shift = _option(_SHIFT)
    march_pc_asm_overlap: int | None = _option("overlap of Schwarz", ge=0, le=100)
    march_pc_asm_type: _Asm = _option("kind of Schwarz")
    march_sub_ksp_type: _Ksp = _on_rank(_KSP)
    march_sub_ksp_rtol: _Tolerance = _on_rank(_RTOL)
    march_sub_ksp_max_it: _Iterations = _on_rank(_MAX_IT)
    march_sub_pc_type: _Local = _on_rank("preconditioner")
    march_sub_pc_factor_mat_ordering_type: _Ordering = _on_rank(_ORDER)
    march_sub_pc_factor_mat_solver_type: _Package = _on_rank(_PACKAGE)
    march_sub_pc_factor_levels: _Levels = _on_rank(_LEVELS)
    march_sub_pc_factor_fill: _Fill = _on_rank(_FILL)
    march_sub_pc_factor_shift_type: _Shift = _on_rank(_SHIFT)

    def given(self) -> dict[str, Any]:
        """The options that the scene gives, by name."""
        return self.model_dump(exclude_none=True)
