"""What is wrong with a scene: all of it, each with its key and one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from catenary.base.errors import Fault, InputError

# More sentences than these nobody reads; the rest is counted.
MOST_TOLD = 50


class SceneError(InputError):
    """A scene with faults. As text it is the first one's sentence and how many there are more.

    Attributes
    ----------
    faults : at least one, the most likely cause first, at most ``MOST_TOLD``
    more : how many others there are
    """

    def __init__(self, faults: Sequence[Fault], more: int = 0) -> None:
        self._of_scene = tuple(faults[:MOST_TOLD])
        self.more = more + max(0, len(faults) - MOST_TOLD)
        others = len(self.faults) - 1 + self.more
        text = self.faults[0].sentence
        super().__init__(
            f"{text} (and {others} more: `catenary check` lists them)" if others else text
        )

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[Fault, ...], int]]:
        """Ranks send it to each other."""
        return type(self), (self.faults, self.more)

    def lines(self) -> list[str]:
        """One sentence for each fault, and one that counts those left out."""
        told = [fault.sentence for fault in self.faults]
        return told + ([f"there are {self.more} more faults"] if self.more else [])


class UnfitScene(SceneError):
    """A scene whose values are allowed one by one, and do not fit together or are implausible."""
