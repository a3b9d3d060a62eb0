"""MPI, started as this process was. Every module takes MPI from here."""

from __future__ import annotations

from catenary.base.process import mpi_settings

with mpi_settings():
    from mpi4py import MPI

__all__ = ["MPI"]
