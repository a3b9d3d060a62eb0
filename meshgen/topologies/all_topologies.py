"""From the data of a line to the line; importing this module registers the shipped topologies."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from catenary.base.errors import InputError
from catenary.meshgen.line import Line
from catenary.meshgen.topologies import named  # noqa: F401  (registers)
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.topologies.overlaps import with_overlaps
from catenary.meshgen.topologies.registry import Topology, registered


def make_line(data: LineData) -> Line:
    """The line of the topology that ``data`` names.

    Raises
    ------
    InputError
        If there is no such topology, or the data make no line.
    """
    topology = registered().get(data.topology)
    if topology is None:
        known = ", ".join(sorted(registered()))
        raise InputError(f"the topology {data.topology} is unknown; it must be one of: {known}")
    for part in topology.parts:
        if getattr(data, part) is None:
            raise InputError(f"the topology {data.topology} needs {part}")
    return _made(topology, data)


@lru_cache(maxsize=16)
def _made(topology: Topology, data: LineData) -> Line:
    """The line of a topology: checks and runs of a scene ask for it many times."""
    data.check()
    line = topology.make(data)
    line = line if data.overlaps is None else with_overlaps(line, data.overlaps)
    return replace(line, curve=data.curve)


__all__ = ["make_line", "registered"]
