"""Part of the catenary namespace: import it as ``catenary.meshgen``."""

if __name__ != "catenary.meshgen":
    raise ImportError(
        "import catenary.meshgen, not meshgen: the folder is installed as catenary.meshgen, "
        "and a second copy under its bare name would hold its own state"
    )
