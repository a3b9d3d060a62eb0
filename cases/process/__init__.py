"""The process of a run: signals, PETSc's options, memory limit, versions."""
