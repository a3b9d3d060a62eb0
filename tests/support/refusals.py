"""A scene that cannot be is refused: one sentence, exit code 2, no traceback, nothing written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from verb_runner import invoke

# A scene of its own, so that a shipped case may change its numbers without a change here.
SOUND = Path(__file__).parents[1] / "regression" / "broken_scenes" / "sound.toml"


def assert_refused(scene: Path, assignments: Sequence[str], expected: str, folder: Path) -> None:
    """Check that ``catenary run`` refuses a scene with ``assignments``, for a reason that is told.

    Parameters
    ----------
    scene : file of a case
    assignments : KEY=VALUE of ``--set``
    expected : what the sentence holds
    folder : where no results may be written afterwards
    """
    words = [word for text in assignments for word in ("--set", text)]
    out = folder / "out"
    result = invoke("run", str(scene), "-o", str(out), *words)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert_one_sentence(result.stderr, out, expected)


def assert_one_sentence(output: str, out: Path, expected: str) -> None:
    """Check the sentence of a refusal, and that nothing was written."""
    sentence = output.strip()
    assert sentence.startswith("catenary: ") and "\n" not in sentence
    assert expected in sentence, sentence
    assert "Traceback" not in output
    assert not out.exists()
