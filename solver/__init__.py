"""Part of the catenary namespace: import it as ``catenary.solver``."""

if __name__ != "catenary.solver":
    raise ImportError(
        "import catenary.solver, not solver: the folder is installed as catenary.solver, "
        "and a second copy under its bare name would hold its own state"
    )
