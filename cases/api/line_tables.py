"""Tables of a scene before any run: its check, its plan, and its line at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catenary.callers import listed
from catenary.cases.scene.scene import problem_of
from catenary.meshgen.wires import Role
from catenary.scenes import SceneLike, checked

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    import pandas as pd
    import xarray as xr

    from catenary.cases.run import plan as planning
    from catenary.cases.scene.scene import Scene as CheckedScene


class Checked(list[str]):
    """Warnings on a scene, from ``check``, and ``sentences`` that ``catenary check`` prints.

    Attributes
    ----------
    sentences : list of str
        On the line, each kind of pantograph, ends, and waves that come back.

    Examples
    --------
    >>> found = catenary.check("en50318_2002")
    >>> found, found.sentences[0]
    ([], 'en50318_2002 is valid: 22 spans, 1320 m, 198 droppers, 3522 nodes')
    """

    def __init__(self, warnings: list[str], sentences: list[str]) -> None:
        super().__init__(warnings)
        self.sentences = sentences


def check(scene: SceneLike) -> Checked:
    """Check a scene with its line hung, beyond what ``load`` checks. Not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.

    Returns
    -------
    Checked
        A list of warnings, for instance of an end so near that it sends waves back; empty if there
        are none.

    Raises
    ------
    InputError
        If anything is wrong, with the sentence that ``catenary check`` prints.

    Examples
    --------
    >>> catenary.check("en50318_2002")
    []
    """
    from catenary.cases.run.at_rest import check_line

    found = check_line(checked(scene))
    return Checked(found.warnings, found.sentences)


class Plan:
    """Plan of a run, from ``plan``: effects simulated and left out, sizes, and needs.

    As text it is what ``catenary plan`` prints.

    Examples
    --------
    >>> plan = catenary.plan("en50318_2002")
    >>> plan.effects.loc["dropper_slackening", "simulated"]
    True
    """

    def __init__(self, own: planning.Plan) -> None:
        self._own = own

    @property
    def effects(self) -> pd.DataFrame:
        """All effects by their names: ``title``, whether ``simulated``, and the ``reason``.

        Examples
        --------
        >>> catenary.plan("en50318_2002").effects.columns.tolist()
        ['title', 'simulated', 'reason']
        """
        import pandas as pd

        rows = [
            {"name": row.name, "title": row.title, "simulated": simulated, "reason": row.reason}
            for chosen, simulated in ((self._own.on, True), (self._own.off, False))
            for row in chosen
        ]
        return pd.DataFrame(rows).set_index("name").astype({"simulated": object})

    @property
    def figures(self) -> pd.Series:
        """Sizes, and estimates of memory [B], of wall time on one rank [s] and of files [B].

        Examples
        --------
        >>> int(catenary.plan("en50318_2002").figures["n_steps"])
        8208
        """
        import pandas as pd

        return pd.Series(self._own.figures, dtype=float)

    @property
    def warnings(self) -> list[str]:
        """Sentences on disturbances of the evaluated stretch, such as waves from a near end.

        Examples
        --------
        >>> catenary.plan("en50318_2002").warnings
        []
        """
        return list(self._own.warnings)

    def __str__(self) -> str:
        from catenary.cases.run.plan import plan_text

        return plan_text(self._own)

    def __repr__(self) -> str:
        return f"<catenary.Plan {self._own.case}: {self._own.needs.n_steps} steps>"


def plan(scene: SceneLike) -> Plan:
    """Plan a run of a scene: its effects, sizes, and needs. Not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        If the scene is wrong.

    Examples
    --------
    >>> print(catenary.plan("en50318_2002"))
    en50318_2002: Reference model of EN 50318:2002
    ...
    """
    from catenary.cases.run.plan import make_plan

    return Plan(make_plan(checked(scene)))


class AtRest:
    """A line at rest as tables, from ``static``. As text it is what the program prints.

    Examples
    --------
    >>> rest = catenary.static("en50318_2002")
    >>> rest.droppers.query("span == 11").length_m.round(3).tolist()[:2]
    [0.972, 0.79]
    """

    def __init__(self, scene: CheckedScene, data: dict[str, np.ndarray]) -> None:
        self._scene = scene
        self._data = data

    @property
    def droppers(self) -> pd.DataFrame:
        """A row for each dropper, along the track.

        ``span`` from 1; ``x_m`` along the track and ``in_span_m`` from the support before it;
        ``length_m`` unstretched, as cut; ``force_N`` the tension at rest; the wires ``hangs_from``
        and ``carries``.

        Examples
        --------
        >>> bool((catenary.static("en50318_2002").droppers.force_N > 0).all())
        True
        """
        import pandas as pd

        data = self._data
        span = data["dropper_span"].astype(int)
        table = pd.DataFrame(
            {
                "span": span + 1,
                "x_m": data["dropper_x"],
                "in_span_m": data["dropper_x"] - data["support_x"][span],
                "length_m": data["dropper_length"],
                "force_N": data["dropper_force"],
                "hangs_from": data["dropper_upper"],
                "carries": data["dropper_lower"],
            }
        )
        return table.sort_values("x_m", kind="stable", ignore_index=True)

    @property
    def contact_wires(self) -> pd.DataFrame:
        """A row for each node of the contact wires: ``wire``, ``x_m``, ``height_m`` above the rail.

        Of lines whose wires move sideways also ``y_m``, to the left of the track.

        Examples
        --------
        >>> bool(catenary.static("en50318_2002").contact_wires.height_m.max() > 5.0)
        True
        """
        import pandas as pd

        names = [wire.name for wire in problem_of(self._scene).line.wires_of(Role.CONTACT)]
        sizes = [self._data[f"wires/{name}"].size for name in names]
        columns = {"x_m": "contact_x", "height_m": "contact_height", "y_m": "contact_y"}
        there = {own: self._data[name] for own, name in columns.items() if name in self._data}
        return pd.DataFrame({"wire": np.repeat(names, sizes), **there})

    @property
    def elasticity(self) -> pd.DataFrame:
        """Lift of a head by a unit force along the middle span: ``x_m``, ``elasticity_mm_per_N``.

        Examples
        --------
        >>> bool(catenary.static("en50318_2002").elasticity.elasticity_mm_per_N.max() < 1.0)
        True
        """
        import pandas as pd

        lift = 1e3 * self._data["elasticity"]
        return pd.DataFrame({"x_m": self._data["elasticity_x"], "elasticity_mm_per_N": lift})

    @property
    def steady_arms(self) -> pd.DataFrame:
        """A row for each steady arm: ``x_m``, ``wire`` and, of lines that move sideways, forces.

        Then ``stagger_m`` is the place of the wire to the left of the track, ``radial_N``,
        ``lift_N`` and ``along_N`` the force of the arm on it to the left, upward and along the
        track, and ``tension_N`` that of the arm, negative if the wire pushes it.

        Examples
        --------
        >>> catenary.static("en50318_2002").steady_arms.columns.tolist()
        ['x_m', 'wire']
        >>> catenary.static("ac_simple_3d").steady_arms.stagger_m.abs().max() > 0.1
        True
        """
        import pandas as pd

        from catenary.postproc.read.registration import Registration

        x, numbers = self._data["arm_x"], self._data["arm_wire"].astype(int)
        names = [name.removeprefix("wires/") for name in self._data if name.startswith("wires/")]
        order = np.argsort(x, kind="stable")  # as in a Registration
        columns = {"x_m": x[order], "wire": [names[number] for number in numbers[order].tolist()]}
        table = Registration.of(self._data)
        if table is None:
            return pd.DataFrame(columns)
        left, up, along = table.force.T
        return pd.DataFrame(
            {
                **columns,
                "stagger_m": table.stagger,
                "radial_N": left,
                "lift_N": up,
                "along_N": along,
                "tension_N": table.tension,
            }
        )

    def sensitivity(
        self, parameters: str | Iterable[str] = (), *, droppers: bool = False
    ) -> xr.Dataset:
        """Changes of contact wires and elasticity in the middle span by parameters.

        Parameters
        ----------
        parameters : str or sequence of str
            Keys as of ``catenary.sensitivity``; the usual ones of the line if there are none.
        droppers : bool
            Whether the length of each dropper in the evaluated stretch is a parameter, too: how
            many millimetres it is too long.

        Returns
        -------
        xarray.Dataset
            ``height`` (wire, x) [m] and ``elasticity`` (x) [m/N]; per unit of each parameter
            ``by_height`` (parameter, wire, x), ``by_elasticity`` (parameter, x) and
            ``by_non_uniformity`` (parameter), which is (max - min) / (max + min) of the elasticity
            along the span; ``unit`` (parameter) of its key. Its attribute ``left_out`` has
            sentences on usual parameters by which the line has no derivative.

        Raises
        ------
        InputError
            If a key is wrong or does not change the line, or if the line has no derivative by it.

        Examples
        --------
        >>> found = catenary.static("en50318_2002").sensitivity("line.contact_wire.tension_N")
        >>> bool((found.by_elasticity < 0.0).all())  # a tighter wire gives way less
        True
        """
        import xarray as xr

        from catenary.cases.studies.parameters.derivatives import rest_sensitivity_of

        names = listed(parameters, "parameters")
        found = rest_sensitivity_of(self._scene, names, droppers=droppers)
        height = {"units": "m", "long_name": "height of the contact wire at rest above top of rail"}
        lift = {"units": "m/N", "long_name": "elasticity"}

        def per_unit(of: dict[str, str]) -> dict[str, str]:
            name = f"change of {of['long_name']} by one unit of the parameter"
            return {"units": f"{of['units']} per unit of the parameter", "long_name": name}

        uneven = {"units": "1", "long_name": "non-uniformity of the elasticity"}
        return xr.Dataset(
            {
                "height": (("wire", "x"), found.height.T, height),
                "elasticity": ("x", found.elasticity, lift),
                "by_height": (
                    ("parameter", "wire", "x"),
                    found.by_height.transpose(0, 2, 1),
                    per_unit(height),
                ),
                "by_elasticity": (("parameter", "x"), found.by_elasticity, per_unit(lift)),
                "by_non_uniformity": ("parameter", found.by_non_uniformity, per_unit(uneven)),
                "unit": ("parameter", [one.unit for one in found.parameters]),
            },
            {
                "parameter": [one.key for one in found.parameters],
                "wire": found.wires,
                "x": ("x", found.x, {"units": "m", "long_name": "position along the track"}),
            },
            {"left_out": [f"{key}: {why}" for key, why in found.left_out.items()]},
        )

    def __str__(self) -> str:
        from catenary.cases.run.at_rest import rest_text

        return rest_text(self._scene, self._data)

    def __repr__(self) -> str:
        return f"<catenary.AtRest {self._scene.case.name}>"


def static(scene: SceneLike) -> AtRest:
    """The line of a scene at rest: droppers, heights, elasticity, steady arms. Not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.

    Returns
    -------
    AtRest

    Raises
    ------
    InputError
        If the scene is wrong, or if its line cannot hang.

    Examples
    --------
    >>> print(catenary.static("en50318_2002"))
     span  in span [m]  length [m]  force [N]
    ...
    """
    from catenary.cases.run.at_rest import static_table

    own = checked(scene)
    return AtRest(own, static_table(own))


def write_rest(rest: AtRest, file: Path, registration: bool = False) -> None:
    """Write a line at rest: its droppers as CSV, or its steady arms, or all of it as JSON.

    Not collective. The ending of the file decides; ``registration`` is for the steady arms, an
    InputError if none pulls a wire sideways. RunBroken if the disk refuses.
    """
    from catenary.cases.run.at_rest import write_static

    write_static(file, rest._data, registration)
