"""All methods on the paper's seven bodies over 20 s. Not part of ``make test``: about a minute.

.venv/bin/python -m pytest -s tests/benchmarks/test_multibody_agreement.py
"""

from __future__ import annotations

from agreement import print_agreement, ways


def test_all_methods_agree_over_twenty_seconds() -> None:
    """The head's heights within 1e-6 m, by every method; joints within 1e-9 m.

    Fixed steps of 0.5 ms are wrong by (w h)^2 / 12 of what swings at w, like over 2 s, since what
    swings is damped within a second; the raising at 0.43 Hz, which is not, has w h = 1e-3.
    """
    found = ways(20.0, 0.5e-3)
    far = print_agreement(found, "two coordinates in the plane")
    assert max(far.values()) < 1e-6
    assert max(way.opened for way in found.values()) < 1e-9
