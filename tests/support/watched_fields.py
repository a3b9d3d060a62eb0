"""Snapshots of a march of tests, their blocks and times."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pyvista

from catenary.meshgen.mesh import CONTACT_WIRE, DROPPERS, MESSENGER_WIRE
from catenary.postproc.record.snapshots.contents import ARMS, MASTS
from catenary.postproc.record.snapshots.fields import FieldRecorder

BLOCKS = (CONTACT_WIRE, MESSENGER_WIRE, DROPPERS, ARMS, MASTS)


def watch(march: Any, path: Path, most_kept: int = 4, **options: Any) -> FieldRecorder:
    recorder = FieldRecorder(march.comm, path, march.recorded, **{"every": 50, **options})
    recorder.most_kept = most_kept
    return recorder


def times_in(path: Path) -> list[float]:
    """Times of the snapshots that a reader of XML finds."""
    return [float(item.attrib["Value"]) for item in ElementTree.parse(path).iter("Time")]


def blocks_at(path: Path, time: float) -> dict[str, pyvista.DataSet]:
    """The blocks of a file at a time by name."""
    reader = pyvista.get_reader(path)
    (number,) = np.flatnonzero(np.isclose(reader.time_values, time, rtol=1e-9))
    reader.set_active_time_point(int(number))
    found = reader.read()
    return {name: found[name] for name in found.keys()}
