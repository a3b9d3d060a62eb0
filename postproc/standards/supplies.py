"""Supply systems of the standards, and the unit of speed in which these are written."""

from __future__ import annotations

SYSTEMS = {"ac": "AC", "dc_3kv": "DC 3 kV", "dc_1500v": "DC 1.5 kV"}
KMH = 3.6  # km/h in 1 m/s
