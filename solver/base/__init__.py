"""Base of all parts: errors, ranks, MPI, PETSc, signals. Installed as ``catenary.base``."""

if __name__ != "catenary.base":
    raise ImportError(
        f"import catenary.base, not {__name__}: the folder is installed as catenary.base, "
        "and a second copy under another name would hold its own state"
    )
