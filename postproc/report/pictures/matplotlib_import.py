"""Matplotlib imported for a program that draws and ends."""

from __future__ import annotations

import sys


def import_matplotlib() -> None:
    """Import Matplotlib without the docstrings that it makes up of its classes. Not collective.

    It lists the properties of some 120 classes as docstrings of their methods ``set`` when it is
    imported, which is a third of the import. At a prompt, where somebody may read them, it does so.
    """
    if hasattr(sys, "ps1"):
        return
    from matplotlib import artist

    listing = artist.kwdoc
    artist.kwdoc = lambda artist: ""
    try:
        import matplotlib.figure  # noqa: F401
    finally:
        artist.kwdoc = listing
