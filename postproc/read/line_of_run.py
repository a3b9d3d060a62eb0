"""The line of a result file: what is written of it once, its shape and its values at rest."""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import NamedTuple

import numpy as np

from catenary.meshgen.mesh import elements_of
from catenary.meshgen.wires import Role
from catenary.postproc.read.marched_results import MarchedFile
from catenary.postproc.read.registration import Registration
from catenary.postproc.read.validated_file import ValidatedFile

# Places along the line come from sums of span lengths, which round by far less [m].
_ROUNDING = 1e-6


def in_stretch(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Whether places ``x`` (n,) of the line are in a stretch, its ends included, (n,) bool."""
    return np.asarray((x >= start - _ROUNDING) & (x <= end + _ROUNDING))


class ContactProfile(NamedTuple):
    """A contact wire at rest.

    breaks : places among its nodes at which further pieces of it begin
    x, height : of its nodes along the track, and above the rail [m]
    y : of its nodes to the left [m]; None where no wire moves sideways
    """

    breaks: np.ndarray
    x: np.ndarray
    height: np.ndarray
    y: np.ndarray | None = None

    def pieces(self) -> list[slice]:
        """Its nodes, piece by piece."""
        ends = [0, *self.breaks.tolist(), self.x.size]
        return [slice(*pair) for pair in itertools.pairwise(ends) if pair[0] < pair[1]]

    def height_at(self, x: np.ndarray) -> np.ndarray:
        """Height of its lowest piece at places ``x`` along the track [m], infinite where it has
        none."""
        height = np.full(np.shape(x), np.inf)
        for own in self.pieces():
            piece = np.interp(x, self.x[own], self.height[own], np.inf, np.inf)
            height = np.minimum(height, piece)
        return height

    def drawn(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places along the track and values at the nodes, with a gap between pieces."""
        x = np.insert(self.x, self.breaks, self.x[self.breaks])
        return x, np.insert(values, self.breaks, np.nan)


# The tables of a result file, which is open and valid, or of a march that wrote none.
ResultTables = ValidatedFile | MarchedFile


class LineOfRun:
    """Constants of a result file that is open. Not collective.

    Parameters
    ----------
    file : ResultTables
    """

    def __init__(self, file: ResultTables) -> None:
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

    def contact_profiles(self) -> dict[str, ContactProfile]:
        """Each contact wire at rest by its name."""
        names, wires = self.wires_of(Role.CONTACT), self.wires()
        ends = np.cumsum([wires[name].size for name in names])[:-1]
        columns = [
            np.split(self.static(f"contact_{own}"), ends)
            for own in ("x", "height", "y")
            if own != "y" or self.has_static("contact_y")
        ]
        return {
            name: ContactProfile(self._breaks(name), *own)
            for name, *own in zip(names, *columns, strict=True)
        }

    def elements(self) -> dict[str, np.ndarray]:
        """Nodes of the elements of each wire, (n, 2) each, in order of x."""
        return {name: elements_of(own, self._breaks(name)) for name, own in self.wires().items()}

    def _breaks(self, wire: str) -> np.ndarray:
        """Places among the nodes of a wire at which further pieces of it begin."""
        path = f"line/breaks/{wire}"
        return np.asarray(self._file[path][...] if path in self._file else [], dtype=np.int64)

    def static(self, name: str) -> np.ndarray:
        """A dataset of ``/static``, for instance ``dropper_length``."""
        return np.asarray(self._file[f"static/{name}"][...])

    def has_static(self, name: str) -> bool:
        """Whether ``/static`` has a dataset, which lines may be without."""
        return f"static/{name}" in self._file

    def registration(self) -> Registration | None:
        """Steady arms at rest; None of straight wires."""
        if not self.has_static("arm_force"):
            return None
        names = ("arm_stagger", "arm_force", "arm_tension")
        table = {name: self.static(name) for name in names}
        known = {"arm_x": self.line("arm_x"), "arm_wire": self.line("arm_wire")}
        return Registration.of({**table, **known}, list(self.roles))

    def arm_wires(self) -> list[str]:
        """Name of the wire that each steady arm holds."""
        names = list(self.roles)
        return [names[number] for number in self.line("arm_wire").tolist()]

    def dropper_wires(self) -> np.ndarray:
        """Numbers of the upper and the lower wire of each dropper, (n_droppers, 2)."""
        of_node = np.zeros(self.line("node_points").shape[0], dtype=np.int64)
        wires = self.wires()
        for number, name in enumerate(self.roles):
            of_node[wires[name]] = number
        return of_node[self.line("droppers")].reshape(-1, 2)

    @cached_property
    def evaluation(self) -> tuple[float, float]:
        """From and to of the stretch whose statistics are judged [m]."""
        start, end = self.line("evaluation_range")
        return float(start), float(end)

    @cached_property
    def reference_span(self) -> int:
        """The span that is shown for all, counted from 0: the one in the middle of the evaluation
        stretch, or the nearest to it outside of overlaps."""
        masts = self.line("support_x")
        middle = 0.5 * sum(self.evaluation)
        span = int(np.clip(np.searchsorted(masts, middle, side="right") - 1, 0, masts.size - 2))
        middles = 0.5 * (masts[:-1] + masts[1:])
        heights = [wire.height_at(middles) for wire in self.contact_profiles().values()]
        wires = np.isfinite(heights).sum(axis=0)
        usual = np.flatnonzero(wires == np.median(wires))
        if wires[span] <= np.median(wires) or not usual.size:
            return span
        return int(usual[np.argmin(np.abs(middles[usual] - middle))])

    @cached_property
    def span_at_rest(self) -> int:
        """The span along which the elasticity is known, counted from 0: one in the middle of the
        line outside overlaps."""
        at, masts = self.static("elasticity_x"), self.line("support_x")
        if not at.size:
            return self.reference_span
        return int(np.searchsorted(masts, 0.5 * (at[0] + at[-1]), side="right")) - 1
