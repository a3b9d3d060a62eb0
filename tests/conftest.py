"""Lets tests import what they share, the modules of ``tests/support``, by their plain names."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).with_name("support")))
