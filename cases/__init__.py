"""Part of the catenary namespace: import it as ``catenary.cases``."""

if __name__ != "catenary.cases":
    raise ImportError(
        "import catenary.cases, not cases: the folder is installed as catenary.cases, "
        "and a second copy under its bare name would hold its own state"
    )
