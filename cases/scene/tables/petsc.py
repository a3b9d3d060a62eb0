"""Scene table of PETSc options: the solver options that a scene may choose, and nothing else.

A scene is data that may come from a stranger, while PETSc's options run programs, load libraries
and write files. So each option that a scene may give is a field here, with its kind and its
bounds: no viewer, no monitor, no path, no option that takes free text. All others are the user's
own and stand on the command line, after ``--``.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from catenary.cases.scene.tables.table import Table

_Ksp = Literal["preonly", "richardson", "cg", "minres", "gmres", "fgmres", "bcgs"]
_Norm = Literal["none", "preconditioned", "unpreconditioned", "natural"]
_Local = Literal["none", "jacobi", "sor", "icc", "ilu", "cholesky", "lu"]
_Pc = Literal["none", "jacobi", "bjacobi", "asm", "sor", "icc", "ilu", "cholesky", "lu"]
_Ordering = Literal["natural", "nd", "1wd", "rcm", "qmd"]
_Package = Literal["petsc", "mumps"]
_Shift = Literal["none", "inblocks"]
_Asm = Literal["basic", "restrict", "interpolate", "none"]


class PetscTable(Table):
    """PETSc's solver of the line; an option's name here is PETSc's without its dash."""

    march_ksp_type: _Ksp | None = Field(None, description="Krylov method")
    march_ksp_rtol: float | None = Field(None, gt=0, le=1e-3, description="relative tolerance")
    march_ksp_atol: float | None = Field(None, ge=0, le=1, description="absolute tolerance")
    march_ksp_divtol: float | None = Field(
        None, ge=10, le=1e12, description="growth of the residual that is taken for divergence"
    )
    march_ksp_max_it: int | None = Field(None, ge=1, le=100_000, description="most iterations")
    march_ksp_norm_type: _Norm | None = Field(None, description="norm that is tested")
    march_ksp_gmres_restart: int | None = Field(
        None, ge=1, le=1000, description="directions that GMRES keeps"
    )
    march_pc_type: _Pc | None = Field(None, description="preconditioner or direct solver")
    march_pc_factor_mat_ordering_type: _Ordering | None = Field(
        None, description="order of the unknowns in a factorisation"
    )
    march_pc_factor_mat_solver_type: _Package | None = Field(
        None, description="package that factorises"
    )
    march_pc_factor_levels: int | None = Field(
        None, ge=0, le=20, description="levels of fill of icc and ilu"
    )
    march_pc_factor_fill: float | None = Field(
        None, ge=1, le=100, description="expected fill of a factorisation"
    )
    march_pc_factor_shift_type: _Shift | None = Field(
        None, description="what is added to small pivots"
    )
    march_pc_asm_overlap: int | None = Field(None, ge=0, le=100, description="overlap of Schwarz")
    march_pc_asm_type: _Asm | None = Field(None, description="kind of Schwarz")
    march_sub_ksp_type: _Ksp | None = Field(None, description="Krylov method on each rank")
    march_sub_ksp_rtol: float | None = Field(
        None, gt=0, le=1e-3, description="relative tolerance on each rank"
    )
    march_sub_ksp_max_it: int | None = Field(
        None, ge=1, le=100_000, description="most iterations on each rank"
    )
    march_sub_pc_type: _Local | None = Field(None, description="preconditioner on each rank")
    march_sub_pc_factor_mat_ordering_type: _Ordering | None = Field(
        None, description="order of the unknowns in a factorisation on each rank"
    )
    march_sub_pc_factor_mat_solver_type: _Package | None = Field(
        None, description="package that factorises on each rank"
    )
    march_sub_pc_factor_levels: int | None = Field(
        None, ge=0, le=20, description="levels of fill of icc and ilu on each rank"
    )
    march_sub_pc_factor_fill: float | None = Field(
        None, ge=1, le=100, description="expected fill of a factorisation on each rank"
    )
    march_sub_pc_factor_shift_type: _Shift | None = Field(
        None, description="what is added to small pivots on each rank"
    )
    march_ts_adapt_type: Literal["basic", "dsp"] | None = Field(
        None, description="controller of numerics.adaptive_tolerance_N"
    )
    march_ts_adapt_safety: float | None = Field(
        None, ge=0.1, le=1, description="share of the estimated step that is taken"
    )
    march_ts_adapt_reject_safety: float | None = Field(
        None, ge=0.1, le=1, description="the same after a rejected step"
    )
    march_alpha2_snes_atol: float | None = Field(
        None, gt=0, le=1, description="scheme ts_alpha2: residual that ends a step"
    )
    march_alpha2_snes_max_it: int | None = Field(
        None, ge=1, le=1000, description="scheme ts_alpha2: most iterations of Newton's method"
    )

    def given(self) -> dict[str, Any]:
        """The options that the scene gives, by name."""
        return self.model_dump(exclude_none=True)


# What is said of every other option.
ELSEWHERE = (
    "is no PETSc option that a scene may give: solver options with bounded values only; all others "
    "stand on the command line after --"
)
