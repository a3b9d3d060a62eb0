"""Part of the catenary namespace: import it as ``catenary.postproc``."""

if __name__ != "catenary.postproc":
    raise ImportError(
        "import catenary.postproc, not postproc: the folder is installed as catenary.postproc, "
        "and a second copy under its bare name would hold its own state"
    )
