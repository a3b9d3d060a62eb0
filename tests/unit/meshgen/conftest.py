"""A small line, and mesh files written by hand."""

from __future__ import annotations

import random
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from catenary.meshgen.line import DropperKind, Line, SteadyArm
from catenary.meshgen.topologies.all_topologies import make_line as line_from
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Conductor


def _line(**changes: object) -> LineData:
    settings: dict[str, object] = {
        "span_lengths": (50.0, 60.0, 60.0, 45.0),
        "dropper_positions": (
            (10.0, 25.0, 40.0),
            (5.0, 18.0, 42.0, 55.0),
            (5.0, 18.0, 42.0, 55.0),
            (22.5,),
        ),
        "pre_sag": ((0.0, 0.02, 0.0), (0.0, 0.03, 0.03, 0.0), (0.0, 0.03, 0.03, 0.0), (0.01,)),
        "stagger": (0.0, 0.2, -0.2, 0.2, 0.0),
        "contact_height": 5.3,
        "encumbrance": 1.4,
        "contact_wire": Conductor(20e3, 1.35, 195.0),
        "messenger_wire": Conductor(16e3, 1.07, 131.7),
        "dropper": DropperKind(1e5, None, 0.1, 0.195, 0.165),
        "support_stiffness": 5e5,
        "steady_arm": SteadyArm(1.2, 0.73, 0.2, 300.0),
        "n_transition": (1, 1),
        "transition_rise": 0.4,
    }
    return LineData(**{**settings, **changes})  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def make_line() -> Callable[..., LineData]:
    """Four uneven spans with pre-sag and rising ends; keywords replace fields."""
    return _line


@pytest.fixture(scope="session")
def line() -> Line:
    """The line of these spans."""
    return line_from(_line())


@dataclass
class HandMade:
    """Content of a mesh file: points by number, elements of lines and points by group."""

    points: dict[int, tuple[float, float, float]]
    lines: dict[str, list[tuple[int, ...]]]
    nodes: dict[str, list[int]]
    empty: dict[str, int] = field(default_factory=dict)

    def copy(self) -> HandMade:
        return deepcopy(self)

    def write(self, path: Path) -> Path:
        """Write MSH 2.2 in ASCII, elements shuffled and every second one turned round."""
        dimensions = {**dict.fromkeys(self.lines, 1), **dict.fromkeys(self.nodes, 0), **self.empty}
        groups = {
            name: (dimension, 10 + i) for i, (name, dimension) in enumerate(dimensions.items())
        }
        elements = []
        for name, members in self.lines.items():
            for i, pair in enumerate(members):
                # 1 is Gmsh's line of two nodes, 8 its line of three
                kind = 1 if len(pair) == 2 else 8
                elements.append(
                    (kind, groups[name][1], pair[::-1] if i % 2 and kind == 1 else pair)
                )
        for name, numbers in self.nodes.items():
            elements += [(15, groups[name][1], (number,)) for number in numbers]
        random.Random(7).shuffle(elements)
        text = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(groups))]
        text += [f'{dimension} {number} "{name}"' for name, (dimension, number) in groups.items()]
        text += ["$EndPhysicalNames", "$Nodes", str(len(self.points))]
        text += [f"{number} {x} {y} {z}" for number, (x, y, z) in self.points.items()]
        text += ["$EndNodes", "$Elements", str(len(elements))]
        for i, (kind, group, members) in enumerate(elements, start=1):
            text.append(f"{i} {kind} 2 {group} {group} {' '.join(map(str, members))}")
        text += ["$EndElements", ""]
        path.write_text("\n".join(text), encoding="ascii")
        return path


@pytest.fixture
def by_hand() -> HandMade:
    """Two spans of 10 m, a dropper in the middle of each; numbers are sparse and in no order.

    Contact wire 901-905 at z = 5, messenger wire 11-15 at z = 6, x = 0, 5, 10, 15, 20; the second
    dropper has a node of its own half-way, 500; node 77 is used by nothing.
    """
    contact = dict(zip((903, 901, 905, 902, 904), (0.0, 5.0, 10.0, 15.0, 20.0), strict=True))
    messenger = dict(zip((15, 12, 11, 14, 13), (0.0, 5.0, 10.0, 15.0, 20.0), strict=True))
    points = {number: (x, 0.1, 5.0) for number, x in contact.items()}
    points[77] = (3.0, 3.0, 3.0)
    points[500] = (15.0, 0.05, 5.5)
    points |= {number: (x, 0.0, 6.0) for number, x in messenger.items()}
    order = list(contact), list(messenger)
    return HandMade(
        points,
        {
            "contact_wire": list(zip(order[0][:-1], order[0][1:], strict=True)),
            "messenger_wire": list(zip(order[1][:-1], order[1][1:], strict=True)),
            "droppers": [(12, 901), (14, 500), (902, 500)],
        },
        {"steady_arms": [905], "supports": [11], "anchors": [903, 904, 15, 13]},
    )
