"""A march without a solver: analytic signals shown to observers through real stages and views."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from catenary.mbs.lumped import LumpedData
from catenary.meshgen.line import DropperKind, Line, SteadyArm
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line as make_line_of
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Conductor
from catenary.postproc.files.facts import facts_of
from catenary.postproc.files.header import Header, line_datasets, static_datasets, wire_roles
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.record.snapshots.contents import RecordedLine
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Damping, Numerics, Placement, Problem, Train
from catenary.solver.statics.elasticity import Elasticity
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

N_SPANS, SPAN = 16, 50.0
DROPPERS = tuple(5.0 + 5.0 * k for k in range(9))
SPEED = 300.0 / 3.6
EVALUATION = (250.0, 550.0)


def make_line() -> Line:
    sag = tuple(0.05 * (1.0 - ((x - SPAN / 2) / 20.0) ** 2) for x in DROPPERS)
    return make_line_of(
        LineData(
            span_lengths=(SPAN,) * N_SPANS,
            dropper_positions=(DROPPERS,) * N_SPANS,
            pre_sag=(sag,) * N_SPANS,
            stagger=tuple(0.2 * (-1) ** i for i in range(N_SPANS + 1)),
            contact_height=5.3,
            encumbrance=1.2,
            contact_wire=Conductor(20e3, 1.33, 180.0),
            messenger_wire=Conductor(16e3, 1.07, 130.0),
            dropper=DropperKind(1e5, None, 0.117, 0.195, 0.165),
            support_stiffness=5e5,
            steady_arm=SteadyArm(1.2, 0.7, 0.2, 300.0),
            n_transition=(1, 1),
            transition_rise=0.5,
        )
    )


def make_mesh(line: Line) -> LineMesh:
    """Two wires with a node at every mast and dropper and two between any of them."""
    masts = line.support_positions
    stations = np.unique(
        np.concatenate([masts, *(m + np.array(DROPPERS) for m in masts[:-1])]).round(6)
    )
    x = np.unique(
        np.concatenate(
            [
                a + (b - a) * np.arange(3) / 3
                for a, b in zip(stations[:-1], stations[1:], strict=True)
            ]
        )
    )
    x = np.append(x, stations[-1])
    n = x.size
    within = np.mod(x, SPAN)
    contact_z = line.profiles[0].level(x) - 0.05 * np.clip(
        1.0 - ((within - SPAN / 2) / 20.0) ** 2, 0.0, None
    )
    messenger_z = 6.5 - 0.4 * within * (SPAN - within) / (SPAN / 2) ** 2
    points = np.zeros((2 * n, 3))
    points[:, 0] = np.tile(x, 2)
    points[:, 2] = np.concatenate([contact_z, messenger_z])

    def node(position: np.ndarray) -> np.ndarray:
        return np.abs(x[None, :] - position[:, None]).argmin(axis=1)

    at = np.setdiff1d(stations, masts)
    return LineMesh(
        points=points,
        wires={CONTACT_WIRE: np.arange(n), MESSENGER_WIRE: n + np.arange(n)},
        droppers=np.column_stack([n + node(at), node(at)]),
        steady_arms=node(masts[1:-1]),
        supports=n + node(masts[1:-1]),
        anchors=np.array([0, n - 1, n, 2 * n - 1]),
    )


def make_problem(line: Line, n_pantographs: int, **changes: Any) -> Problem:
    """What facts are derived from; ``dt`` and ``speed`` may be others."""
    pantograph = LumpedData((7.2, 15.0), (4.2e3, 50.0), (10.0, 90.0))
    return Problem(
        line=line,
        damping=Damping(1e-4, 0.0125),
        contact=LinearLaw(5e4, 0.0),
        train=Train(
            speed=changes.get("speed", SPEED),
            start=60.0,
            end=700.0,
            raise_time=0.0,
            placements=(Placement(pantograph, 150.0, 0.0),) * n_pantographs,
        ),
        numerics=Numerics(changes["dt"], "one_solve", 0.25, 0.5, 1e-6, 1e-6, 10),
        evaluation=EVALUATION,
        residual_stiffness_ratio=0.0,
        effects=frozenset({"structural_damping", "dropper_slackening"}),
    )


def make_header(problem: Problem, mesh: LineMesh, **attributes: Any) -> Header:
    line = problem.line
    height = mesh.points[:, 2]
    length = height[mesh.droppers[:, 0]] - height[mesh.droppers[:, 1]]
    force = np.full(length.size, 65.0) + 8.0 * np.cos(mesh.x(mesh.droppers[:, 1]))
    equilibrium = Equilibrium(height, np.zeros(height.size), force, length)
    x = 8 * SPAN + np.linspace(0.0, SPAN, 41)
    lift = 1e-3 * (0.33 + 0.12 * np.sin(np.pi * (x - x[0]) / SPAN) ** 2)
    elasticity = Elasticity(x, lift[:, None, None])
    known: dict[str, Any] = {
        "case": "made_up",
        "title": "A made-up line <with> & awkward title",
        "n_dofs": 2 * mesh.n_nodes,
        "system": "ac",
        "rules": ["en50367:2006"],
        "versions": {"catenary": "0.1.0", "petsc": "3.18.5", "python": "3.11"},
        "config": {"line": {"n_spans": N_SPANS}, "numerics": {"scheme": "one_solve"}},
        "wires": wire_roles(line),
        "effects_on": [
            ("vertical", "vertical motion of the tensioned wires", "always"),
            ("dropper_slackening", "droppers that slacken", "default"),
        ],
        "effects_off": [("lateral", "stagger and lateral motion", "not asked for")],
    }
    datasets = {
        **line_datasets(line, mesh, EVALUATION),
        "static/dropper_length": equilibrium.dropper_length,
        **static_datasets(line, mesh, equilibrium, elasticity),
    }
    return Header({**known, **attributes}, datasets, facts_of(problem, mesh, length))


BLOCK = 500  # steps


def row_of(values: Mapping[str, np.ndarray]) -> tuple[np.ndarray, dict[str, slice]]:
    """A row of these values by channel, and where in it each channel is."""
    ends = np.cumsum([0, *(array.size for array in values.values())]).tolist()
    columns = {
        name: slice(*part) for name, part in zip(values, itertools.pairwise(ends), strict=True)
    }
    return np.concatenate([np.zeros(0), *values.values()]), columns


@dataclass
class March:
    """Drives observers with signals whose statistics are known."""

    n_steps: int = 8000
    dt: float = 1e-3
    start: float = 60.0
    separations: tuple[float, ...] = (0.0, 100.0)
    speed: float = SPEED
    comm: Any = field(default_factory=lambda: MPI.COMM_SELF)

    def __post_init__(self) -> None:
        self.line = make_line()
        self.mesh = make_mesh(self.line)
        self.arm_x = self.mesh.x(self.mesh.steady_arms)
        self.dropper_x = self.mesh.x(self.mesh.droppers[:, 1])
        self.recorded = RecordedLine(self.line, self.mesh, np.zeros(self.mesh.n_nodes))
        self.tension = 1000.0 * np.arange(self.mesh.n_nodes)
        own_arms = self.arm_x[self.own(self.arm_x.size)]
        own_droppers = self.dropper_x[self.own(self.dropper_x.size)]
        self._own_x = np.concatenate([own_droppers, own_arms])
        self._at_rest = 65.0 + 8.0 * np.cos(own_droppers)
        self._own_nodes = self.mesh.points[self.own(self.mesh.n_nodes), 0]
        self._blocks: dict[int, dict[str, np.ndarray]] = {}

    def header(self, **attributes: Any) -> Header:
        problem = make_problem(self.line, len(self.separations), dt=self.dt, speed=self.speed)
        return make_header(problem, self.mesh, **attributes)

    def own(self, count: int) -> np.ndarray:
        """This rank's share of ``count`` things: contiguous, as on a line cut into spans."""
        return np.array_split(np.arange(count), self.comm.size)[self.comm.rank]

    def stage(self, first_step: int = 0) -> Stage:
        return Stage(
            train=channels.TrainLayout((1,) * len(self.separations)),
            dt=self.dt,
            start_time=first_step * self.dt,
            n_steps=self.n_steps,
            arm_x=self.arm_x,
            dropper_x=self.dropper_x,
            owned_arms=self.own(self.arm_x.size),
            owned_droppers=self.own(self.dropper_x.size),
            node_points=self.mesh.points,
            owned_nodes=self.own(self.mesh.n_nodes),
            n_places=(2,) * len(self.separations),
        )

    # Times may be one [s], or a column of many: then there is a row for each.
    def position(self, t: Any) -> np.ndarray:
        return self.start + SPEED * t - np.asarray(self.separations)

    def force(self, t: Any) -> np.ndarray:
        """Mean 150 N, 30 N amplitude at the span frequency, growing parts at 9 and 60 Hz."""
        p = np.arange(len(self.separations))
        phase = 2 * np.pi * t
        return (
            150.0
            + (30.0 + 6.0 * p) * np.sin(phase * SPEED / SPAN + p)
            + (15.0 + 5.0 * p) * np.sin(phase * 9.0 + 2 * p)
            + 10.0 * np.sin(phase * 60.0)
        )

    def wave(self, t: Any, x: np.ndarray) -> np.ndarray:
        """Uplift of the line at positions x: a hump around each pantograph with a wake [m]."""
        ahead = x - self.position(t)[..., None]
        wake = 0.02 * np.exp(np.minimum(ahead, 0.0) / 60.0) * np.sin(0.35 * ahead)
        hump = 0.06 * np.exp(-((ahead / 9.0) ** 2))
        return np.asarray((hump + np.where(ahead < 0, wake, 0.0)).sum(axis=-2))

    def places(self, t: float) -> np.ndarray:
        """Bases at rest, heights of a head and of the frame below it for each pantograph [m]."""
        x, n = self.position(t), len(self.separations)
        heads = 5.28 + self.wave(t, x)
        return np.concatenate([np.zeros(n), np.column_stack([heads, 0.5 * heads]).ravel()])

    def motion(self, t: float, x: np.ndarray, name: str, rate: bool) -> np.ndarray:
        """The wave, its slope, or the rate of them."""
        if rate:
            late, early = (self.motion(t + d, x, name, False) for d in (1e-6, -1e-6))
            return (late - early) / 2e-6
        if name == "w":
            return self.wave(t, x)
        return (self.wave(t, x + 1e-6) - self.wave(t, x - 1e-6)) / 2e-6

    def block(self, number: int) -> dict[str, np.ndarray]:
        """Values of channels in a block of steps, a row each: all at once take a tenth of the time
        that they take one by one."""
        if number not in self._blocks:
            t = self.dt * (number * BLOCK + np.arange(BLOCK))[:, None]
            position = self.position(t)
            n_droppers = self._at_rest.size
            uplift = self.wave(t, self._own_x)
            wire = 5.3 - 0.02 + 0.015 * np.sin(2 * np.pi * position / SPAN)
            slack = 90.0 / 0.06 * np.maximum(uplift[:, :n_droppers], 0.0)
            self._blocks[number] = {
                "contact_position": position,
                "contact_force": self.force(t),
                "head_height": wire - 0.002,
                "wire_height": wire,
                "dropper_force": np.maximum(self._at_rest - slack, -0.5),
                "arm_uplift": uplift[:, n_droppers:],
            }
        return self._blocks[number]

    def view(self, step: int) -> StepView:
        t, nodes = step * self.dt, self._own_nodes
        number, row_in_block = divmod(step, BLOCK)
        values = {name: rows[row_in_block] for name, rows in self.block(number).items()}
        row, columns = row_of(values | self.more(step))
        return StepView(
            step=step,
            time=t,
            row=row,
            columns=columns,
            node_motion=lambda name, rate, among=None: self.motion(
                t, nodes if among is None else nodes[among], name, rate
            ),
            wire_tension=lambda: self.tension,
            pantograph_places=lambda: self.places(t),
            line_state=dict,
            energies=lambda: (2.0 + np.sin(t), 3.0 + np.cos(t)),
            state=lambda: {"step": step, "state": np.full(50, float(step)), "kind": "made up"},
        )

    def more(self, step: int) -> dict[str, np.ndarray]:
        """Values of further channels at a step."""
        return {}

    def drive(
        self,
        *observers: Observer,
        outcome: str = "done",
        first_step: int = 0,
        last: int | None = None,
    ) -> None:
        stage = self.stage(first_step)
        for observer in observers:
            observer.start(stage)
        for step in range(first_step, (self.n_steps if last is None else last) + 1):
            view = self.view(step)
            for observer in observers:
                observer.observe(view)
        for observer in observers:
            observer.finish(outcome)


PERFORMANCE = {
    "phase_wall_s": {"mesh": 0.1, "equilibrium": 0.2, "march": 5.1, "report": 0.5},
    "march_wall_s": 4.0,
    "records_wall_s": 1.0,
    "inner_iterations": {"steps": 8000, "iterations": 8400},
}


def record(path: Path, march: March, **options: Any) -> Path:
    """A finished result file."""
    attributes = options.pop("attributes", {})
    recorder = Recorder(march.comm, path, march.header(**attributes), **options)
    march.drive(recorder)
    recorder.close(PERFORMANCE)
    return path


@pytest.fixture(scope="session")
def march() -> March:
    return March()


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory, march: March) -> Path:
    """A folder with the result file of a finished run of two pantographs. Read only."""
    folder = tmp_path_factory.mktemp("run")
    record(folder / "run.h5", march, energy_every=100)
    return folder


@pytest.fixture(scope="session")
def make_march() -> type[March]:
    return March


@pytest.fixture(scope="session")
def record_run() -> Any:
    return record


@pytest.fixture(scope="session", name="make_problem")
def _make_problem() -> Any:
    return make_problem
