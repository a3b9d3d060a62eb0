"""Writes a state of ParaView, which opens a run without Python: ParaView's own program makes it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

STATE = "view.pvsm"
PROGRAM, _SCREEN = "pvpython", "xvfb-run"
# Longest that ParaView may take [s].
_PATIENCE = 300.0
# Without -noreset a screen starts anew whenever nobody is connected to it, and refuses whoever
# comes meanwhile: ParaView connects, leaves and connects again.
SCREEN_OF_ITS_OWN = "-screen 0 1600x900x24 -noreset"
# Two that begin at one time may take one screen, which the first to end takes from the other.
_ATTEMPTS, _LOST = 3, "X server connection"


def write_state(script: Path) -> tuple[Path | None, str]:
    """Write ``view.pvsm`` beside the script that opens a run. Not collective.

    Returns
    -------
    The state, and an empty text; or None, and one sentence that says why there is none.
    """
    command, why = _command()
    if not command:
        return None, why
    state = script.with_name(STATE)
    part = script.with_name(f".{script.stem}.{os.getpid()}{state.suffix}")
    try:
        part.unlink(missing_ok=True)  # a link that was put there would be written through
        for _ in range(_ATTEMPTS):
            done = subprocess.run(
                [*command, str(script), "--state", str(part)],
                capture_output=True,
                text=True,
                timeout=_PATIENCE,
                check=False,
            )
            if done.returncode == 0 and part.is_file():
                os.replace(part, state)
                return state, ""
            if _LOST not in done.stderr:
                break
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        # The program that makes the screen complains last, about what it cannot clean up.
        own = [line for line in lines if not line.startswith(_SCREEN)]
        why = f"{PROGRAM} failed: {(own or lines or ['it wrote nothing'])[-1]}"
    except (OSError, subprocess.TimeoutExpired) as error:
        why = f"{PROGRAM} failed: {error}"
    finally:
        part.unlink(missing_ok=True)
    return None, f"no state is written, the script does the same ({why})"


def _command() -> tuple[Sequence[str], str]:
    """Command that starts ParaView's Python here, or the reason why none can."""
    if shutil.which(PROGRAM) is None:
        return (), f"no state is written: {PROGRAM} is not on this machine"
    if not sys.platform.startswith("linux"):
        return (PROGRAM,), ""
    # Debian's draws on a screen only. One of its own is there whatever DISPLAY says.
    if shutil.which(_SCREEN) is not None:
        # Two that begin at one time look for a free number from different ones on.
        number = str(100 + os.getpid() % 5000)
        return (_SCREEN, "-a", "-n", number, "-s", SCREEN_OF_ITS_OWN, PROGRAM), ""
    if os.environ.get("DISPLAY"):
        return (PROGRAM,), ""
    return (), f"no state is written: {PROGRAM} needs a screen, or {_SCREEN}"
