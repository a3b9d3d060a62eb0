"""Units of scene keys: which suffix stands for which unit, and the conversions to SI."""

from __future__ import annotations

import math

# One table gives each key its unit. Longest suffix first, so that "_kg_per_m" is not read as "_m".
SUFFIXES: dict[str, str] = {
    "_N_s2_per_m2": "N s2/m2",
    "_kg_per_m3": "kg/m3",
    "_N_per_m1_5": "N/m^1.5",
    "_N_s_per_m": "N s/m",
    "_mm_per_s": "mm/s",
    "_um_per_m": "um/m",
    "_percent": "%",
    "_m_per_s": "m/s",
    "_kg_per_m": "kg/m",
    "_N_per_m": "N/m",
    "_kg_m2": "kg m2",
    "_N_m2": "N m2",
    "_deg": "deg",
    "_km_h": "km/h",
    "_hz": "Hz",
    "_per_s": "1/s",
    "_per_K": "1/K",
    "_GPa": "GPa",
    "_mm2": "mm2",
    "_mm": "mm",
    "_kg": "kg",
    "_m": "m",
    "_N": "N",
    "_s": "s",
    "_K": "K",
}


def unit_of(key: str) -> str:
    """Unit that the last part of a dotted key names, "" where it names none."""
    name = next((part for part in reversed(key.split(".")) if not part.isdigit()), "")
    return next((unit for suffix, unit in SUFFIXES.items() if name.endswith(suffix)), "")


def without_unit(name: str) -> str:
    """A key's last part without the unit at its end."""
    return next((name.removesuffix(end) for end in SUFFIXES if name.endswith(end)), name)


def speed_from_km_h(speed: float) -> float:
    """Speed [m/s] from ``speed`` [km/h]."""
    return speed / 3.6


def angle_from_deg(angle: float) -> float:
    """Angle [rad] from ``angle`` [deg]."""
    return math.radians(angle)


def length_from_mm(length: float) -> float:
    """Length [m] from ``length`` [mm]."""
    return length / 1000.0


def area_from_mm2(area: float) -> float:
    """Area [m2] from ``area`` [mm2]."""
    return area * 1e-6


def pressure_from_GPa(pressure: float) -> float:
    """Pressure [N/m2] from ``pressure`` [GPa]."""
    return pressure * 1e9
