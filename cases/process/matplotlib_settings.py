"""No settings of the user's in Matplotlib: pictures have the program's own style.

Matplotlib reads a ``matplotlibrc`` when it is imported: that in the working directory, else that of
``MATPLOTLIBRC``, else that of the user. One that is no text ends the import.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

VARIABLE = "MATPLOTLIBRC"
_FILE = Path("matplotlibrc")


def leave_out() -> None:
    """See to it, before Matplotlib is imported, that it reads no ``matplotlibrc`` of a user's.

    Where the working directory has one it is imported here, from a folder that has none.
    """
    os.environ[VARIABLE] = os.devnull
    if os.path.lexists(_FILE):
        with contextlib.chdir(Path(__file__).parent):
            import matplotlib  # noqa: F401
