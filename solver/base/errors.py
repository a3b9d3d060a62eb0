"""Errors that a user sees: one sentence, one exit code. A leaf module: imports no other of ours."""

from typing import Any, NamedTuple


class Fault(NamedTuple):
    """A key of a scene and the sentence that says what is wrong with it."""

    key: str
    sentence: str


class CatenaryError(Exception):
    """An error with a sentence for the user and an exit code for the shell."""

    exit_code = 1


class InputError(CatenaryError):
    """The scene, the mesh or the command line asks for something impossible (exit code 2).

    The message is one sentence that names the key, its value, what is allowed and where.

    Attributes
    ----------
    faults : tuple of (key, sentence), at least one
        All faults of a scene, the most likely cause first. Any other fault is one
        sentence with an empty key.
    """

    exit_code = 2
    _of_scene: tuple[Fault, ...] = ()

    @property
    def faults(self) -> tuple[Fault, ...]:
        """All faults, each with its key."""
        return self._of_scene or (Fault("", str(self)),)


class RunBroken(CatenaryError):
    """The run could not be continued: NaN, no convergence, disk full (exit code 1).

    The message names time, place and remedy; the result file stays readable up to the last step.

    Attributes
    ----------
    run : catenary.Run or None
        The record up to there, where ``catenary.run`` raises it.
    """

    exit_code = 1
    run: Any = None


class NotConverged(RunBroken):
    """The equations of a step were not solved within the iterations that they are given."""
