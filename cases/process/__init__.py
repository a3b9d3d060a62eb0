"""The process of a run: signals, libraries and PETSc's options, further processes beside it."""
