"""Kernels of the time loop, compiled from C++: names and types of the extension.

What functions, records and methods do and hold is said where they are declared, in the headers.
"""

from collections import namedtuple
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

class Kernel:
    """A function over arrays and records; arrays are taken as they are, and written in place.

    Arrays of other types, or of shapes that do not fit each other, are refused by ``TypeError`` and
    ``ValueError``. Places that stand in arrays are not checked.
    """

    def __call__(self, *arguments: Any) -> Any: ...
    def bound(self, *first: Any) -> Bound:
        """The function with its first arguments: a call gives the others."""

class Bound:
    """A kernel with its first arguments, which it keeps alive."""

    def __call__(self, *later: Any) -> Any: ...

# Records: named tuples of the members of structs in C++.
Across = namedtuple("Across", "place, rate, moved")
Affine = namedtuple("Affine", "place, rate, by_force, rate_by_force")
Ahead = namedtuple(
    "Ahead",
    "dt, n_done, drives, ties, one_speed, most_speed, longest_way, turns, most_turn, look_steps",
)
Alpha = namedtuple(
    "Alpha",
    "dt, ratio, known_of_balanced, known_of_own, position_of_own, position_of_known, "
    "velocity_of_own, velocity_of_known, damping_on_stiffness",
)
Answers = namedtuple("Answers", "by_force, slope")
Bending = namedtuple("Bending", "tables, first, wires")
Block = namedtuple("Block", "times, drives, rows, now, behind, kept, counts")
Bounds = namedtuple("Bounds", "push, pull, loss")
ChangedRows = namedtuple("ChangedRows", "weights, kinds, begin, offsets, values, reach, room, sums")
Changes = namedtuple(
    "Changes",
    "dt, by_position, by_velocity, damping_share, known, velocity, balance, by_mass",
)
Changing = namedtuple("Changing", "places, begins, terms, forces, factors, numbers")
Columns = namedtuple("Columns", "ends, starts, first, last")
ContactWork = namedtuple(
    "ContactWork",
    "total, force, local, value, before, ahead, share_before, share_after, dt",
)
Contacts = namedtuple(
    "Contacts",
    "x, touches, wires, columns, answers, gains, motion, motion_gains, followed, "
    "link_columns, work, sideways, across",
)
Coupled = namedtuple("Coupled", "band, released, slackens, behind, drop")
Cuts = namedtuple("Cuts", "low, high, begin, width, at")
Dependents = namedtuple("Dependents", "links, begin")
Depths = namedtuple("Depths", "depth, rate")
FactorArrays = namedtuple(
    "FactorArrays",
    "kinds, blocks, beside_kinds, besides, low, ends, sections",
)
Followed = namedtuple("Followed", "numbers, links, reserve, moving, dependents, dependent_numbers")
Gains = namedtuple("Gains", "train_speed, position, velocity, reach")
HeadArrays = namedtuple("HeadArrays", "touch, state, out, newmark, roll")
HeadChange = namedtuple("HeadChange", "matrix, by_drive, by_head, inverse, state, beside, step")
HeadLaws = namedtuple("HeadLaws", "ways, law, points, pressed")
KeptMotions = namedtuple(
    "KeptMotions",
    "motion_of, numbers, stations, used, moved, places, kept_places",
)
LawChange = namedtuple("LawChange", "tangents, hertz, speed, latest")
Leads = namedtuple("Leads", "contact, first, middle, lead")
LineExtremes = namedtuple("LineExtremes", "arms, droppers, rest, uplift, least, largest")
LinearStep = namedtuple("LinearStep", "matrix, by_drive, by_head, inverse")
LinkChange = namedtuple("LinkChange", "law, weights")
Links = namedtuple("Links", "unknowns, weights, law")
Loads = namedtuple("Loads", "clock, values, constant, changing, sampled, memories")
Lowering = namedtuple("Lowering", "time, drop, memory")
MarchTangents = namedtuple("MarchTangents", "groups, pairs, links, first, switches")
Memories = namedtuple("Memories", "into, own, latest, known, shares, tables")
MemoryTables = namedtuple("MemoryTables", "ends, past, sums, near, spectra, room, turns")
Motion = namedtuple("Motion", "x, y, z, shares, spacing")
Newmark = namedtuple(
    "Newmark",
    "dt, predict_position, predict_velocity, work_velocity, position_factor, velocity_factor, "
    "damping_share",
)
NewmarkFactors = namedtuple(
    "NewmarkFactors",
    "dt, predict_position, predict_velocity, position, velocity",
)
PassArrays = namedtuple("PassArrays", "factor, velocity, loads, answer, motion, known, predicted")
PassParts = namedtuple("PassParts", "layouts, station_types, rows, factors, arrays, changes")
ProductArrays = namedtuple("ProductArrays", "kinds, blocks, first, sections")
ReducedMechanism = namedtuple("ReducedMechanism", "tables, weight, zero")
Regulation = namedtuple("Regulation", "settings, gains, memory, waiting")
ReportedForces = namedtuple("ReportedForces", "gamma, from_time, latest, reported")
Sampled = namedtuple("Sampled", "loads, times, places, samples")
Sections = namedtuple("Sections", "starts, station_type")
Share = namedtuple("Share", "flags, present, line, rows, bounds")
Shown = namedtuple(
    "Shown",
    "motion, arms, droppers, others, dropper_bends, other_bends, other_force, columns",
)
Sideways = namedtuple("Sideways", "local, owned, rest")
Signs = namedtuple("Signs", "always, behind")
SmallProblem = namedtuple(
    "SmallProblem",
    "heads, share, gap, pulls, tangents, coupled, unknowns, found, max_rounds",
)
SplineTables = namedtuple("SplineTables", "breaks, coefficients")
SprungMasses = namedtuple("SprungMasses", "masses, stiffness, damping, push")
StationBlocks = namedtuple("StationBlocks", "before, own, after")
StepLaw = namedtuple("StepLaw", "marched, reported")
StepParts = namedtuple(
    "StepParts",
    "speed, contacts, train, free, loads, heads, strips, problem, law, lateral_place, "
    "switched, train_outputs, outputs, shown, channels",
)
StripEnds = namedtuple("StripEnds", "of_strip, of_pantograph")
System = namedtuple("System", "right, solution, matrix")
Tangent = namedtuple("Tangent", "rest, links, heads, drives, law, start, speed, results")
TangentGroup = namedtuple("TangentGroup", "lanes, tangents")
TangentLanes = namedtuple("TangentLanes", "passes, motion, loads, rows")
Tangents = namedtuple("Tangents", "own, offset, by_depth, by_rate")
TrackedLinks = namedtuple("TrackedLinks", "links, reserve, ranges, stretch")
TrainPlaces = namedtuple("TrainPlaces", "start, now, leads")
Turning = namedtuple("Turning", "to_end, to_start, here")
Unknowns = namedtuple("Unknowns", "always, behind, matrix, right, solution, room")
Window = namedtuple(
    "Window",
    "state, every, guard, by_motion, spans_behind, spans_ahead, fading, is_exact, peak, "
    "contacts, loaded, margin, masts, low, high, starts, links_before, ends, kinds, turning, "
    "links, ranges, known",
)
Wires = namedtuple("Wires", "nodes, surface")

spline_at: Kernel
tables_at: Kernel
sines_at: Kernel
polyline_at: Kernel

BODY_PRODUCT: np.dtype[np.void]
BODY_LINE: np.dtype[np.void]

rotation_matrices: Kernel
move_bodies: Kernel
add_gyroscopic_moments: Kernel
body_products: Kernel
body_lines: Kernel
independent_rows: Kernel

DRIVE: np.dtype[np.void]
HEAD_LAW: np.dtype[np.void]
HEAD_LAW_POINT: np.dtype[np.void]
REGULATION: np.dtype[np.void]
CONTROL_GAINS: np.dtype[np.void]
REGULATION_MEMORY: np.dtype[np.void]
LOWERING_MEMORY: np.dtype[np.void]

class Head:
    """A pantograph that steps by Newmark's method, of any model. It keeps ``HeadArrays`` and the
    further arrays of the model, and reads and writes them in place."""

    first: int
    added_force: float
    def bend(self, bending: object) -> None: ...
    def lower(self, lowering: object) -> None: ...
    def regulate(self, regulation: object) -> None: ...
    def step(self, drive: np.ndarray) -> bool: ...
    def advance(self, contact_force: np.ndarray) -> None: ...
    def extrapolate(self, drive: np.ndarray, early: np.ndarray) -> None: ...

class LinearChain(Head):
    """A chain of lumped masses on linear springs and dampers."""

    def __init__(self, arrays: object, linear: object) -> None: ...

class LawfulChain(Head):
    """A chain of lumped masses with laws, driven at the coordinate ``carrier``."""

    def __init__(self, arrays: object, masses: object, laws: object, carrier: int) -> None: ...

class RaisedHead(Head):
    """A head over a reduced mechanism, whose height is the last coordinate."""

    def __init__(self, arrays: object, masses: object, laws: object, mechanism: object) -> None: ...
    @property
    def height(self) -> float: ...

class CalledHead(Head):
    """A head whose steps are calls: ``predict(time)`` fills ``out``, see ``HeadState.numbers``, and
    ``advance(contact_force)`` takes the step. What they raise ends the call that steps the head."""

    def __init__(
        self,
        out: np.ndarray,
        predict: Callable[[float], None],
        advance: Callable[[np.ndarray], None],
    ) -> None: ...

RESERVE: np.dtype[np.void]
MOST_UNKNOWNS: int
NODE: np.dtype[np.void]
SAMPLE: np.dtype[np.void]
TOUCH: np.dtype[np.void]
FLAGS: np.dtype[np.void]
SLIP: float
NOWHERE: float
MEETING: np.dtype[np.void]
FACTOR: np.dtype[np.void]
SAMPLED_LOAD: np.dtype[np.void]
END_MEMORY: np.dtype[np.void]
MIDDLES: int
NEAR: int

middle_of: Kernel
turn: Kernel
eliminate: Kernel
join: Kernel

condense_spans: Kernel
cut_out: Kernel
bridge: Kernel
add_waves: Kernel

evaluate: Kernel
recall: Kernel
fourier_forth: Kernel

take_extremes: Kernel
take_points: Kernel

predict: Kernel
predict_alpha: Kernel
correct: Kernel
displacements: Kernel
velocities: Kernel
reserves: Kernel
energy_of_switching: Kernel

locate: Kernel
place: Kernel
heights: Kernel
find_across: Kernel
respond: Kernel
superpose: Kernel
compensate: Kernel
begin_work: Kernel
add_work: Kernel
move_contacts: Kernel
write_outputs: Kernel

subtract: Kernel
any_switched: Kernel
couple: Kernel
find_solution: Kernel
pivot: Kernel
find_zero: Kernel
under: Kernel
leaves_out: Kernel
solve: Kernel

MOST_TANGENTS: int
linearise: Kernel
remember: Kernel

class Room:
    """Room to solve the small problem of a step for so many unknowns."""

    def __init__(self, most: int) -> None: ...

class Layout:
    """How the unknowns of a station stand in vectors, and which products blocks of such rows or
    factors need: those of a kernel that was compiled for them, if there is one of few more."""

    def __init__(
        self, own: np.ndarray, beside: np.ndarray, damped: bool, factors: bool
    ) -> None: ...
    def places(self, which: str) -> np.ndarray: ...
    @property
    def is_sparse(self) -> bool: ...
    @property
    def n_products(self) -> int: ...
    @property
    def n_vectors(self) -> int: ...
    @property
    def row_size(self) -> int: ...

def are_compiled(rows: Layout, factors: Layout) -> bool:
    """Whether kernels were compiled for stations of such rows and factors; general kernels step
    others, with masks found at run time."""

def scenes_at_once(layouts: Sequence[tuple[Layout, Layout]]) -> list[int]:
    """Numbers of scenes, ascending, that kernels of this processor step side by side on a line with
    stations of such rows and factors."""

class Products:
    """Products with rows of K, and C, of stations of each type."""

    def __init__(
        self, layouts: Sequence[Layout], station_types: Sequence[Sequence[int]], rows: object
    ) -> None: ...
    def multiply(
        self,
        begin: int,
        end: int,
        factor: np.ndarray,
        velocity: np.ndarray,
        result: np.ndarray,
    ) -> None: ...

class Solves:
    """Solves with factors of stations of each type."""

    def __init__(
        self, layouts: Sequence[Layout], station_types: Sequence[Sequence[int]], factors: object
    ) -> None: ...
    def solve(self, right: np.ndarray, answer: np.ndarray) -> None: ...

class TwoPasses:
    """Free steps in two passes with the arrays of ``PassParts``, which they keep, read and write in
    place."""

    def __init__(self, parts: object) -> None: ...
    def track(self, links: object) -> None: ...
    def open(self, window: object) -> None: ...
    def step(self) -> None: ...
    def predict_velocities(self) -> None: ...

LEAST_STATIONS: int

left_behind: Kernel
turn_to: Kernel
show: Kernel
keep: Kernel

COUNTS: np.dtype[np.void]

class Taken:
    """How a block of steps has ended: whether the next one is begun, up to its free step; whether
    there is no room for the motion of the last one."""

    @property
    def begun(self) -> bool: ...
    @property
    def is_full(self) -> bool: ...

class Steps:
    """Steps of the scheme ``one_solve`` on one rank, of ``StepParts`` and a ``Block`` of these."""

    def __init__(self, parts: object, block: object) -> None: ...
    def take(self, first: int, end: int) -> Taken: ...
    def write(self, path: str, ahead: object) -> None: ...

class ScenePasses:
    """``TwoPasses`` in several scenes side by side, with arrays of all of them in ``parts``."""

    def __init__(self, parts: object) -> None: ...
    def step(self) -> None: ...
    def track(self, links: object, rest: np.ndarray, reserves: Sequence[np.ndarray]) -> None: ...
    def rest(self, lane: int) -> None: ...

class Ensemble:
    """Marches of several scenes side by side, with ``LineExtremes``."""

    def __init__(self, passes: ScenePasses, extremes: object) -> None: ...
    def begin(self, lane: int, steps: Steps, n: int) -> None: ...
    def take(self, most: int) -> None: ...
    def at(self, lane: int) -> tuple[int, bool]: ...

class LanePasses:
    """``TwoPasses`` of tangents side by side, with arrays of all lanes in ``parts``, of the
    stations that move: ``guard`` outer ones are looked at, or all move from the start on if it is
    0."""

    def __init__(self, parts: object, guard: int) -> None: ...
    @property
    def begin(self) -> int: ...
    @property
    def end(self) -> int: ...

class TangentSteps:
    """``Steps`` with derivatives by parameters beside them, of ``Tangents``."""

    def __init__(self, parts: object, block: object, tangents: object) -> None: ...
    def take(self, first: int, end: int) -> Taken: ...

TIE: np.dtype[np.void]

class Simulation:
    """A prepared line with its pantographs, stepped from outside, see ``catenary.Simulation``.

    Arrays look into it, and last as long as they are held.
    """

    def __init__(self, path: str) -> None: ...
    def step(self, n: int = 1) -> bool: ...
    def set_speed(self, speed: float) -> bool: ...
    def save(self) -> bytes: ...
    def restore(self, state: bytes) -> None: ...
    @property
    def inputs(self) -> np.ndarray: ...
    @property
    def time(self) -> float: ...
    @property
    def dt(self) -> float: ...
    @property
    def way(self) -> float: ...
    @property
    def speed(self) -> float: ...
    @property
    def most_speed(self) -> float: ...
    @property
    def n_steps_left(self) -> int: ...
    @property
    def contact_force(self) -> np.ndarray: ...
    @property
    def head_height(self) -> np.ndarray: ...
    @property
    def wire_height(self) -> np.ndarray: ...
    @property
    def strip_force(self) -> np.ndarray: ...

def targets() -> list[str]:
    """Targets that kernels were compiled for and this processor can run, the best last."""

def set_target(name: str) -> bool:
    """Use the kernels of one of these for lines made from now on; whether it exists."""

def flush_subnormals() -> int:
    """Let this thread take subnormal numbers for zero, if it can; returns the mode before."""

def restore_subnormals(before: int) -> None:
    """Restore the mode before."""
