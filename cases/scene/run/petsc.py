"""Scene table of PETSc options: the solver options that a scene may choose, and nothing else.

A scene is data that may come from a stranger, while PETSc's options run programs, load libraries
and write files. So each option that a scene may give is a field here, with its kind and its
bounds: no viewer, no monitor, no path, no option that takes free text. All others are the user's
own and stand on the command line, after ``--``.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from catenary.cases.scene.keys.table import Table

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
