"""The line of a result file: what is written of it once, its shape and its values at rest."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from catenary.meshgen.mesh import elements_of
from catenary.meshgen.wires import Role
from catenary.postproc.read.registration import Registration
from catenary.postproc.read.sound_file import SoundFile


class LineOfRun:
    """Constants of a result file that is open. Not collective.

    Parameters
    ----------
    file : SoundFile
    """

    def __init__(self, file: SoundFile) -> None:
        self._file = file

    def line(self, name: str) -> np.ndarray:
        """A dataset of ``/line``, for instance ``support_x``."""
        return np.asarray(self._file[f"line/{name}"][...])

    def wires(self) -> dict[str, np.ndarray]:
        """Node numbers of each wire in order of x."""
        return {name: np.asarray(nodes[...]) for name, nodes in self._file["line/wires"].items()}

    @property
    def roles(self) -> dict[str, Role]:
        """The role of each wire by its name, in the order of the line."""
        return {name: Role(role) for name, role in self._file.attrs["wires"].items()}

    def wires_of(self, role: Role) -> list[str]:
        """Names of the wires of a role, in the order of the line."""
        return [name for name, own in self.roles.items() if own is role]

    def contact_profiles(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Positions and heights at rest of the nodes of each contact wire by its name [m]."""
        names, wires = self.wires_of(Role.CONTACT), self.wires()
        ends = np.cumsum([wires[name].size for name in names])[:-1]
        x, height = (np.split(self.static(f"contact_{own}"), ends) for own in ("x", "height"))
        return {name: (x[i], height[i]) for i, name in enumerate(names)}

    def elements(self) -> dict[str, np.ndarray]:
        """Nodes of the elements of each wire, (n, 2) each, in order of x."""
        given = self._file["line/breaks"].items() if "line/breaks" in self._file else ()
        breaks = {name: np.asarray(at[...]) for name, at in given}
        none = np.zeros(0, dtype=np.int64)
        return {
            name: elements_of(nodes, breaks.get(name, none)) for name, nodes in self.wires().items()
        }

    def static(self, name: str) -> np.ndarray:
        """A dataset of ``/static``, for instance ``dropper_length``.

        ``elasticity_of_wires`` of a file without is that of its one contact wire.
        """
        if name == "elasticity_of_wires" and f"static/{name}" not in self._file:
            return self.static("elasticity")[:, None]
        return np.asarray(self._file[f"static/{name}"][...])

    def has_static(self, name: str) -> bool:
        """Whether ``/static`` has a dataset, which lines or earlier files may be without."""
        return f"static/{name}" in self._file

    def registration(self) -> Registration | None:
        """Steady arms at rest; None of straight wires, and in files of earlier versions."""
        if not self.has_static("arm_force"):
            return None
        names = ("arm_stagger", "arm_force", "arm_tension")
        table = {name: self.static(name) for name in names}
        return Registration.of({**table, "arm_x": self.line("arm_x")})

    @cached_property
    def evaluation(self) -> tuple[float, float]:
        """From and to of the stretch whose statistics are judged [m]."""
        start, end = self.line("evaluation_range")
        return float(start), float(end)

    @cached_property
    def reference_span(self) -> int:
        """The span in the middle of the evaluation stretch, counted from 0, shown for all."""
        masts = self.line("support_x")
        middle = 0.5 * sum(self.evaluation)
        return int(np.clip(np.searchsorted(masts, middle, side="right") - 1, 0, masts.size - 2))
