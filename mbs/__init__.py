"""Part of the catenary namespace: import it as ``catenary.mbs``."""

if __name__ != "catenary.mbs":
    raise ImportError(
        "import catenary.mbs, not mbs: the folder is installed as catenary.mbs, "
        "and a second copy under its bare name would hold its own state"
    )
