"""Keys of a scene and statistics of a run in the field's words, for axes and legends."""

from __future__ import annotations

from typing import Any

from catenary.cases.scene.keys.keys import ANY
from catenary.cases.scene.keys.units import SUFFIXES, unit_of
from catenary.cases.terminal.key_list import Key, keys_of_a_scene

STATISTICS_IN_WORDS = {
    "mean_N": "mean contact force [N]",
    "std_N": "standard deviation, 0-20 Hz [N]",
    "std_0_5_N": "standard deviation, 0-5 Hz [N]",
    "std_5_20_N": "standard deviation, 5-20 Hz [N]",
    "max_N": "maximum force [N]",
    "min_N": "minimum force [N]",
    "stat_max_N": "mean + 3 standard deviations [N]",
    "stat_min_N": "mean - 3 standard deviations [N]",
    "loss_percent": "loss of contact [%]",
    "arcing_percent": "arcing NQ [%]",
    "contact_height_range_mm": "contact point, vertical range [mm]",
    "max_uplift_mm": "largest uplift at arms [mm]",
    "n_slackened": "droppers slackened [-]",
    "max_dropper_force_N": "maximum dropper force [N]",
    "min_dropper_force_N": "minimum dropper force [N]",
}
_LONGEST = 48  # a longer meaning explains more than an axis has room for


def key_in_words(key: str) -> str:
    """What a dotted key is, with its table and unit: ``contact wire: tension [N]``."""
    parts = [part for part in key.split(".") if not part.isdigit()]
    known = _known(key)
    told = known is not None and len(known.meaning) <= _LONGEST
    meaning = known.meaning if known is not None and told else _plain(parts[-1])
    tables = [_plain(part) for part in parts[1 if told or len(parts) > 2 else 0 : -1]]
    unit = unit_of(key)
    words = f"{', '.join(tables)}: {meaning}" if tables else meaning
    return f"{words} [{unit}]" if unit else words


def value_in_words(key: str, value: Any) -> str:
    """A key's last part with its value and unit: ``speed 250 km/h``."""
    name = _plain(key.rsplit(".", 1)[-1])
    told = str(value).lower() if isinstance(value, bool) else str(value)
    return f"{name} {told} {unit_of(key)}".rstrip()


def _known(key: str) -> Key | None:
    parts = key.split(".")
    for one in keys_of_a_scene():
        pattern = one.name.split(".")
        if len(pattern) == len(parts) and all(
            want in (ANY, part) for want, part in zip(pattern, parts, strict=True)
        ):
            return one
    return None


def _plain(name: str) -> str:
    """A name as it is written in code, without its unit and with spaces."""
    bare = next((name.removesuffix(end) for end in SUFFIXES if name.endswith(end)), name)
    return bare.replace("_", " ")
