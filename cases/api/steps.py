"""A line with its pantographs, stepped from outside."""

from __future__ import annotations

import operator
import tempfile
from hashlib import blake2b, file_digest
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.base.process import alone
from catenary.callers import is_truth, number_of, numbers_of, path_of
from catenary.cases.result_folder.output_folder import new_file
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.scene import Scene
from catenary.scenes import SceneLike, checked
from catenary.solver.kernels import native

_SUFFIX = ".line"
_NAME = 16  # bytes at the begin of a state that name its line


def prepare(scene: SceneLike, out: str | Path, *, force: bool = False) -> Path:
    """Write a line and its pantographs for steps from outside. Not collective.

    C programs step the file by the library of the kernels, Python programs by ``Simulation``:
    mesh, equilibrium and factors, which it holds, are not found again.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.
    out : str or Path
        The file, whose name ends in ``.line``.
    force : bool, optional
        Replace a file that is there.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the scene is wrong, if its steps need what a prepared line lacks (``docs/embedding.md``
        lists it), or if the file is there, or cannot be written.

    Examples
    --------
    >>> with catenary.Simulation(catenary.prepare(scene, folder / "short.line")) as line:
    ...     line.step(10), line.steps_left > 0
    (True, True)
    """
    own, path = checked(scene), path_of(out, "out")
    new_file(path, (_SUFFIX,), force)
    _write(own, path)
    return path


class Simulation:
    """A line with its pantographs, taken on step by step by the program that holds it.

    Steps are those of ``run``, to the last bit, as long as nothing is added to them. One process
    steps a line, under mpirun too: not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one; its line is meshed, hung and factored first.
        A file ``*.line`` that ``prepare`` wrote is ready for steps. Its indices are not checked:
        open files from people you trust alone.

    Raises
    ------
    InputError
        If the scene is wrong, if its steps need what a prepared line lacks (``docs/embedding.md``
        lists it), or if the file is damaged or of another version.

    Examples
    --------
    Ten seconds of a line, or as much as there is of it; a context closes it at its end.

    >>> with catenary.Simulation(catenary.load("en50318_2002", short=True)) as sim:
    ...     while sim.time < 1.0 and sim.step(10):
    ...         error = sim.contact_force - 120.0
    ...         sim.lift_force = -0.2 * error
    >>> round(sim.time, 3)
    1.0
    """

    __slots__ = ("_ended", "_line", "_own")  # what has no such name cannot be set by mistake

    def __init__(self, scene: SceneLike) -> None:
        self._ended = False
        if isinstance(scene, str | Path) and Path(scene).suffix == _SUFFIX:
            self._own, self._line = _opened(path_of(scene, "scene"))
            return
        own = checked(scene)
        with tempfile.TemporaryDirectory(prefix="catenary_line_") as folder:
            path = Path(folder) / f"scene{_SUFFIX}"
            _write(own, path)
            self._own, self._line = _opened(path)

    def step(self, n: int = 1) -> bool:
        """Take steps.

        Parameters
        ----------
        n : int
            How many, at least 0.

        Returns
        -------
        bool
            False if the end of the line came before; the steps up to it were taken.

        Raises
        ------
        InputError
            If it is no number of steps.
        RunBroken
            If a step cannot be taken, with what may be why, if a wire has turned from rest by more
            than a linear line bears, or if the end had come before this call. Only ``restore`` goes
            on then, from an earlier state.

        Examples
        --------
        >>> sim.step(), sim.steps_left > 0
        (True, True)
        """
        try:
            steps = -1 if is_truth(n) else operator.index(n)
        except TypeError:
            steps = -1
        if steps < 0:
            raise InputError(f"step({shown(n)}) must take a whole number of steps, at least 0")
        if self._ended and steps:
            raise RunBroken(
                f"the train is at the end of its way, after {self.time:g} s: restore() an earlier "
                "state, or end the loop when step() returns False"
            )
        try:
            done = self._own.step(min(steps, self.steps_left + 1))
        except RuntimeError as error:
            why = f"after {self.time:g} s {error}{self._state_in_words()}"
            raise RunBroken(f"{why}; restore() an earlier state") from error
        self._ended = not done
        return done

    def save(self) -> bytes:
        """Return the whole state, with additions to forces and bases, for ``restore``.

        Examples
        --------
        >>> state = sim.save()
        >>> before = sim.time
        >>> sim.step(5)
        True
        >>> sim.restore(state)
        >>> sim.time == before
        True
        """
        return self._line + self._own.save()

    def restore(self, state: bytes) -> None:
        """Go back to a state of this line.

        Parameters
        ----------
        state : bytes
            What ``save`` gave, of this object or another one of the same file ``*.line``. Each
            object of a scene has prepared a line of its own.

        Raises
        ------
        InputError
            If it is no state of this line, or damaged.

        Examples
        --------
        >>> sim.restore(sim.save())
        """
        if not isinstance(state, bytes | bytearray | memoryview):
            raise InputError(f"the state is {shown(state)}; it must be the bytes that save() gave")
        line, own = bytes(state[:_NAME]), bytes(state[_NAME:])
        try:
            if line != self._line:
                raise ValueError("this is no state of this line")
            self._own.restore(own)
        except ValueError as error:
            raise InputError(
                f"{error}: a state fits the Simulation that saved it, and others of the same "
                f"{_SUFFIX} file"
            ) from error
        self._ended = False

    @property
    def time(self) -> float:
        """Time since time zero of the run [s].

        Examples
        --------
        >>> sim.time >= 0.0
        True
        """
        return self._own.time

    @property
    def dt(self) -> float:
        """A time step [s].

        Examples
        --------
        >>> sim.dt
        0.001
        """
        return self._own.dt

    @property
    def way(self) -> float:
        """Way of the train since time zero [m].

        Examples
        --------
        >>> abs(sim.way - sim.speed * sim.time) < 1e-9
        True
        """
        return self._own.way

    @property
    def speed(self) -> float:
        """Speed of the train [m/s]; to set it lets the train go on at another one from here.

        Air and static force stay those of the scene's speed.

        Raises
        ------
        InputError
            If it is negative or no number, if it is not below the wave speed of the contact wire
            and ``effects.supercritical_speed`` is not on, or if heads of the scene roll or bend,
            its vehicle follows a track, or its pantographs meet tunnels or stretches of another
            wind: what a pantograph meets at a place is prepared for one speed.

        Examples
        --------
        >>> round(3.6 * sim.speed, 3)
        250.0
        """
        return self._own.speed

    @speed.setter
    def speed(self, value: float) -> None:
        value = number_of(value, "speed")
        if self._own.set_speed(value):
            return
        if not (np.isfinite(value) and value >= 0.0):
            raise InputError(f"speed is {value}; it must be at least 0 [m/s] and finite")
        if value >= self._own.most_speed:
            raise InputError(
                f"speed is {value:g} m/s; it must be below the wave speed of the contact wire "
                f"({self._own.most_speed:.4g} m/s) unless effects.supercritical_speed = true"
            )
        raise InputError(
            f"speed cannot be set to {value:g} m/s: heads of this scene roll or bend, its vehicle "
            "follows a track, or its pantographs meet tunnels or stretches of another wind, and "
            "what they meet at a place is prepared for one speed"
        )

    @property
    def steps_left(self) -> int:
        """Steps to the end of the prepared run, at the scene's speed.

        Examples
        --------
        >>> sim.steps_left > 100
        True
        """
        return self._own.n_steps_left

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs, in running order wherever there is one value of each.

        Examples
        --------
        >>> sim.n_pantographs
        1
        """
        return int(self._own.contact_force.size)

    @property
    def contact_force(self) -> np.ndarray:
        """Contact force of each pantograph after the latest step, (n_pantographs,) [N].

        At least 0, in compression. A new array each time, as of all that is measured.

        Examples
        --------
        >>> sim.contact_force.shape
        (1,)
        """
        return self._own.contact_force.copy()

    @property
    def head_height(self) -> np.ndarray:
        """Height of each pan head above top of rail, (n_pantographs,) [m].

        Examples
        --------
        >>> bool(5.0 < sim.head_height[0] < 5.3)
        True
        """
        return self._own.head_height.copy()

    @property
    def wire_height(self) -> np.ndarray:
        """Height of the contact wire above top of rail at each pan head, (n_pantographs,) [m].

        Examples
        --------
        >>> bool(5.0 < sim.wire_height[0] < 5.3)
        True
        """
        return self._own.wire_height.copy()

    @property
    def strip_force(self) -> np.ndarray:
        """Contact force of each strip, (n_strips,) [N]: pantograph by pantograph, leading first.

        Examples
        --------
        >>> float(sim.strip_force.sum()) == float(sim.contact_force.sum())
        True
        """
        return self._own.strip_force.copy()

    @property
    def lift_force(self) -> np.ndarray:
        """Force added to the static force of each pantograph, (n_pantographs,) [N], upward.

        It acts from the next step on until it is set again. A number is taken for all pantographs;
        ``lift_force[0] = 5.0`` sets it for one. The scene's own regulation adds to it. While a
        pantograph is raised (``train.raise_time_s``) it acts in full, where a regulation of the
        scene acts with the part of the static force that is there.

        Raises
        ------
        InputError
            If a value is no finite number, or if there are more or fewer than pantographs.

        Examples
        --------
        >>> sim.lift_force = 5.0
        >>> sim.lift_force.tolist()
        [5.0]
        """
        return self._own.inputs["lift_force"]

    @lift_force.setter
    def lift_force(self, value: Any) -> None:
        self._add("lift_force", value)

    @property
    def head_force(self) -> np.ndarray:
        """Force added on the head of each pantograph, (n_pantographs,) [N], upward.

        Strips on springs of their own share it, as they do a force of the air on the head. As
        ``lift_force``, and with its errors.

        Examples
        --------
        >>> sim.head_force = [-2.0]
        >>> sim.head_force.tolist()
        [-2.0]
        """
        return self._own.inputs["head_force"]

    @head_force.setter
    def head_force(self, value: Any) -> None:
        self._add("head_force", value)

    @property
    def base(self) -> np.ndarray:
        """Height added to the base of each pantograph, (n_pantographs,) [m], upward.

        It adds to the motion of the scene's vehicle and acts from the next step on. Springs to the
        base feel the height, dampers ``base_velocity``, and the weight of mechanisms
        ``base_acceleration``: set what belongs together. As ``lift_force``, and with its errors.

        Examples
        --------
        >>> sim.base, sim.base_velocity = 0.002, 0.1
        >>> sim.base.tolist(), sim.base_velocity.tolist()
        ([0.002], [0.1])
        """
        return self._own.inputs["base"]

    @base.setter
    def base(self, value: Any) -> None:
        self._add("base", value)

    @property
    def base_velocity(self) -> np.ndarray:
        """Velocity added to each base, (n_pantographs,) [m/s], upward; see ``base``.

        Examples
        --------
        >>> sim.base_velocity = 0.0
        """
        return self._own.inputs["base_velocity"]

    @base_velocity.setter
    def base_velocity(self, value: Any) -> None:
        self._add("base_velocity", value)

    @property
    def base_acceleration(self) -> np.ndarray:
        """Acceleration added to each base, (n_pantographs,) [m/s2], upward; see ``base``.

        Examples
        --------
        >>> sim.base_acceleration = 0.0
        """
        return self._own.inputs["base_acceleration"]

    @base_acceleration.setter
    def base_acceleration(self, value: Any) -> None:
        self._add("base_acceleration", value)

    def close(self) -> None:
        """Free the memory of the line; only ``time`` can be read afterwards.

        Examples
        --------
        >>> catenary.Simulation(scene).close()
        """
        if not isinstance(self._own, _Closed):
            self._own = _Closed(self._own.time)  # type: ignore[assignment]
            self._ended = False  # what it is now is closed

    def __repr__(self) -> str:
        closed = isinstance(self._own, _Closed)
        left = "closed" if closed else f"{self.steps_left} steps left"
        return f"<catenary.Simulation at {self.time:g} s, {left}>"

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Simulation cannot be pickled: prepare() a file *.line, and open it in each process"
        )

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self.close()

    def _state_in_words(self) -> str:
        """A clause on inputs that are no numbers, or else on what tells of one that drives a
        pantograph away: heights, forces and inputs that are not zero."""
        inputs = self._own.inputs
        names = inputs.dtype.names or ()
        for name in names:
            if not np.isfinite(inputs[name]).all():
                return f": {name} is {inputs[name].tolist()}; it must be finite"
        given = {name: inputs[name] for name in names if inputs[name].any()}
        if not given:
            return ""
        told = {"head_height": self._own.head_height, "contact_force": self._own.contact_force}
        told |= given
        values = (f"{name} {[float(f'{one:.4g}') for one in own]}" for name, own in told.items())
        return f": it has {', '.join(values)}"

    def _add(self, name: str, value: Any) -> None:
        values = numbers_of(value, name)
        own = self._own.inputs[name]
        if values.shape not in ((), own.shape):
            raise InputError(
                f"{name} has the shape {values.shape}; it must be a number, or one of each of "
                f"{own.size} pantographs"
            )
        if not np.isfinite(values).all():
            raise InputError(f"{name} is {values.tolist()}; it must be finite")
        own[:] = values


class _Closed:
    """A simulation that was closed."""

    def __init__(self, time: float) -> None:
        self.time = time

    def __getattr__(self, name: str) -> Any:
        raise InputError("this simulation is closed; make another one, or leave its context later")


def _write(scene: Scene, path: Path) -> None:
    """Write the line of a scene, ready for steps. Not collective."""
    alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.run.at_rest import prepare_line

    prepare_line(scene, path)


def _opened(path: Path) -> tuple[native.Simulation, bytes]:
    """The line of a file, and what names it in states.

    Numbers of a state lie in the order in which the arrays of the line lay in the memory of the
    process that prepared it, so that files of one scene differ, too.
    """
    try:
        own = native.Simulation(str(path))
    except RuntimeError as error:
        raise InputError(str(error)) from error
    with path.open("rb") as file:
        return own, file_digest(file, lambda: blake2b(digest_size=_NAME)).digest()
