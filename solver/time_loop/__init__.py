"""The march: PETSc's time loop drives a scheme, observers see each step."""
