"""The pre-sag that a planner's lengths of droppers give: the inverse of cutting droppers for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import root

from catenary.base.errors import InputError
from catenary.base.files import is_file
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.input.case_files import REMOVED
from catenary.cases.scene.input.csv_files import DROPPER_COLUMNS, LEAST_PRE_SAG, dropper_table
from catenary.cases.scene.load import read_draft
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.scene.starter import DROPPERS_FILE
from catenary.meshgen.wires import SAME_PLACE, Role
from catenary.solver.statics.form_finding import lengths_to_cut

LENGTH = "length_m"
LENGTH_COLUMNS = {**DROPPER_COLUMNS, LENGTH: False}
_HEAD = "# pre-sags that give the planned lengths of the droppers\nspan,position_m,pre_sag_mm"
# Planners give lengths to a millimetre; those of the pre-sag that is written are as close as this.
_CLOSE = 0.02  # [mm]
# Lengths are nearly linear in the pre-sag: one step of Newton's, and Krylov vectors for it.
_MOST_STEPS, _VECTORS = 6, 60


def take_in_lengths(folder: Path) -> float | None:
    """Put pre-sags in place of lengths in the table of droppers beside a new case.

    Not collective.

    Parameters
    ----------
    folder : of the case; its ``droppers.csv`` may have the column ``length_m``, unstretched lengths
        from axis to axis of the wires [m], and is written anew with ``pre_sag_mm`` then

    Returns
    -------
    How far the lengths of droppers that are cut for the pre-sag are from those of the table at most
    [mm]; None if the table has no lengths, or is not there

    Raises
    ------
    InputError
        If the file is no such table, or if no pre-sag gives these lengths.
    """
    path = folder / DROPPERS_FILE
    if not is_file(path):
        return None
    where = f"the table of droppers is {path}"
    hung = dropper_table(path, where, LENGTH_COLUMNS)
    rows = [(span, row) for span, own in hung.items() for row in own]
    if LENGTH not in rows[0][1]:
        return None
    if "pre_sag_mm" in rows[0][1]:
        raise InputError(f"{where}; it has both {LENGTH} and pre_sag_mm: leave one of them out")
    wanted = np.array([row[LENGTH] for _, row in rows])
    draft = read_draft(folder)

    def missing(pre_sag: np.ndarray) -> np.ndarray:
        """Shortage of droppers [mm], positive if too short, that are cut for a pre-sag [mm]."""
        scene = draft.assigned(_patterns(hung, pre_sag, f"in {path.name}")).scene()
        return np.asarray(1e3 * (wanted - _lengths(scene, rows)))

    options = {
        "fatol": _CLOSE,
        "maxiter": _MOST_STEPS,
        "line_search": None,
        "jac_options": {"rdiff": 1.0, "inner_maxiter": _VECTORS},
    }
    try:
        found = root(missing, np.zeros(wanted.size), method="krylov", options=options)
    except InputError as error:
        raise InputError(f"{where}; no pre-sag gives its lengths: {error}") from error
    if not found.success:
        raise InputError(f"{where}; no pre-sag was found that gives its lengths")
    pre_sag = np.round(found.x, 3)
    if np.abs(pre_sag).max() < LEAST_PRE_SAG:  # what is left of rounded lengths
        pre_sag = np.zeros(pre_sag.size)
    lines = [
        f"{span},{row['position_m']:g},{sag:.3f}"
        for (span, row), sag in zip(rows, pre_sag, strict=True)
    ]
    path.write_text("\n".join([_HEAD, *lines]) + "\n", encoding="utf-8")
    return float(np.abs(missing(pre_sag)).max())


def _patterns(
    hung: dict[int, list[dict[str, float]]], pre_sag: np.ndarray, where: str
) -> list[tuple[str, Any, str]]:
    """Values of a scene whose droppers give a pre-sag [mm], in the order of the table."""
    patterns, first = [], 0
    for span, own in hung.items():
        positions = [row["position_m"] for row in own]
        sags = [float(sag) for sag in pre_sag[first : first + len(own)]]
        patterns.append({"spans": [span], "positions_m": positions, "pre_sag_mm": sags})
        first += len(own)
    return [
        ("line.dropper.patterns_file", REMOVED, where),
        ("line.dropper.patterns", patterns, where),
    ]


def _lengths(scene: Scene, rows: Sequence[tuple[int, dict[str, float]]]) -> np.ndarray:
    """Lengths to which droppers of the contact wire are cut, (n_rows,) in the order of a table [m].

    Of twin wires that hang in pairs both droppers of a place have one length. Of two sections side
    by side these are the droppers of the wire that is named first.
    """
    problem, mesh = problem_of(scene), mesh_of(scene)
    line, lengths = problem.line, lengths_to_cut(problem, mesh)
    contact = {wire.name for wire in line.wires_of(Role.CONTACT)}
    groups = [group for group, own in enumerate(line.droppers) if own.lower in contact]
    chosen = np.flatnonzero(np.isin(mesh.dropper_group, groups))
    x = mesh.x(mesh.droppers[chosen, 1])
    masts = line.support_positions
    wanted = np.array([masts[span - 1] + row["position_m"] for span, row in rows])
    order = np.argsort(x, kind="stable")
    at = order[np.minimum(np.searchsorted(x[order], wanted - SAME_PLACE), order.size - 1)]
    assert np.allclose(x[at], wanted, rtol=0.0, atol=SAME_PLACE)
    return np.asarray(lengths[chosen[at]])
