"""A run that is done and goes on to a later end is the run that had that end from the start."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from damaging import unseal
from program import MPIRUN, assert_same_histories, assert_sound, catenary, short_run
from scenes import load_scene, resolved

from catenary import InputError, restart
from catenary.cases.run.continuing import extended_scene
from catenary.postproc.read.results import Results

pytestmark = pytest.mark.usefixtures("examined_here")

# Where the run ends at first, and where the long one and what goes on do [m].
FIRST, LAST = "train.end_m=170", 200.0
SCENE = ("evaluation.from_m=140", "evaluation.to_m=155")
# Of the whole run, the later stretch is evaluated.
LONG = (f"train.end_m={LAST:g}", "evaluation.from_m=150", "evaluation.to_m=190")
LATER = ("--until-m", f"{LAST:g}", "--evaluate", "150:190")
GROWING = ("time", "channels", "line_channels", "energy")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    done = catenary(*short_run(folder / "run", *SCENE, *LONG), cwd=folder)
    assert done.code == 0, done.stderr
    return folder / "run"


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("begun")
    done = catenary(*short_run(folder / "run", *SCENE, FIRST, report=True), cwd=folder)
    assert done.code == 0, done.stderr
    return folder / "run"


def test_a_run_goes_on_to_a_later_end(whole: Path, begun: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    shutil.copytree(begun, out)
    refused = catenary("restart", str(out), cwd=tmp_path)
    assert refused.code == 2 and "unless --until-m says where" in refused.stderr
    done = catenary("restart", str(out), *LATER, cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert_same_histories(out, whole)
    with Results(out) as found, Results(whole) as expected:
        assert found.attributes["config"]["train"] == expected.attributes["config"]["train"]
        for name in ("n_steps_planned", "arrivals", "effects_on", "effects_off", "n_steps"):
            assert found.attributes[name] == expected.attributes[name], name
    assert_same_tables(out, whole)


def test_a_program_in_python_prolongs_a_run(whole: Path, begun: Path, tmp_path: Path) -> None:
    """What is refused first leaves the run as it is. A report of its earlier end does not stay."""
    out = tmp_path / "run"
    shutil.copytree(begun, out)
    for given, says in (
        ({}, "is done; there is nothing to continue"),
        ({"evaluate": (150, 190)}, "evaluate belongs to until_m"),
        ({"until_m": 160}, "until_m is 160, but must be greater than 170"),
        ({"until_m": LAST, "evaluate": (150,)}, "evaluate is 150, but must be two places"),
        ({"until_m": 1e5}, r"in restart\(\) \(until_m\)"),
    ):
        with pytest.raises(InputError, match=says):
            restart(out, **given)
    with pytest.raises(InputError, match="is no folder"):
        restart(tmp_path / "nowhere", until_m=LAST)
    assert (out / "report.html").exists() and (out / "contact_force.png").exists()
    with restart(out, until_m=LAST, evaluate=(150, 190), report=False) as run:
        assert run.outcome == "done" and run.summary["evaluation_m"] == [150.0, 190.0]
        assert "report" in run.phase_wall and run.folder == out
        with Results(whole) as expected:
            assert np.array_equal(run.force, expected.channel("contact_force"))
    left = {path.name for path in out.iterdir() if not path.name.startswith(".")}
    assert left == {"run.h5", "fields.h5", "fields.xdmf", "summary.json"}
    assert_same_histories(out, whole)


@pytest.mark.study
@pytest.mark.process
def test_a_full_disk_leaves_the_run_as_it_is(begun: Path, tmp_path: Path) -> None:
    """The copy fits, its changes do not; HDF5 would crash the program at its end."""
    out = tmp_path / "run"
    shutil.copytree(begun, out)
    before = (out / "run.h5").read_bytes()
    script = (
        "import resource, sys\n"
        "from mpi4py import MPI  # which is not to meet the limit\n"
        "most = int(sys.argv.pop(1)), resource.RLIM_INFINITY\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, most)\n"
        "from catenary.cases.cli.main import main\n"
        "main()\n"
    )
    words = [str(len(before)), "restart", str(out), *LATER]
    done = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True)
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1, done
    assert last.endswith("cannot be given a later end (File too large); it is as it was")
    assert (out / "run.h5").read_bytes() == before and not list(out.glob(".run*"))


def test_a_file_without_checksums_goes_on_as_well(begun: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    shutil.copytree(begun, out)
    with h5py.File(out / "run.h5", "r+") as file:
        unseal(file)
    words = ["restart", str(out), *LATER, "--", "-march_ts_max_steps", "800"]
    assert catenary(*words, cwd=tmp_path).code == 1
    with Results(out) as results:
        assert results.damage == [] and results.outcome == "interrupted"


@pytest.mark.study
@pytest.mark.skipif(MPIRUN is None, reason="needs mpirun")
def test_one_that_is_interrupted_after_that_goes_on_on_other_ranks(
    whole: Path, begun: Path, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    shutil.copytree(begun, out)
    done = catenary(
        "restart", str(out), *LATER, "--", "-march_ts_max_steps", "900", cwd=tmp_path, ranks=2
    )
    assert done.code == 1, done.stderr
    assert_sound(out / "run.h5")
    done = catenary("restart", str(out), cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert_same_histories(out, whole)


def assert_same_tables(out: Path, whole: Path) -> None:
    """Fail unless what grows with time is the same to the last bit, and so are snapshots."""
    with h5py.File(out / "run.h5") as found, h5py.File(whole / "run.h5") as expected:
        names: list[str] = []
        expected.visit(names.append)
        compared = 0
        for name in names:
            if name.split("/")[0] in GROWING and isinstance(expected[name], h5py.Dataset):
                np.testing.assert_array_equal(found[name][...], expected[name][...], name)
                compared += 1
        assert compared > 8
        assert found["line/evaluation_range"][...].tolist() == [150.0, 190.0]
    with h5py.File(out / "fields.h5") as found, h5py.File(whole / "fields.h5") as expected:
        for name in ("times", "pantograph_places", "contact_wire/uplift"):
            # Far from the train there is what is left of 1e-38 m.
            np.testing.assert_allclose(found[name][...], expected[name][...], rtol=0, atol=1e-30)


@pytest.mark.parametrize(
    ("until", "evaluated", "says"),
    [
        (600.0, None, "until_m is 600, but must be greater than 660"),
        (float("nan"), None, "until_m is nan"),
        (1e5, None, r"train.end_m is 100000.* in restart\(\) \(until_m\).*inside the line"),
        (700.0, "600", r"evaluate is 600, but must be two places \[m\], e\.g\. \(360, 600\)"),
        (700.0, "680:640", r"in restart\(\) \(evaluate\).*must end behind its start"),
    ],
)
def test_an_end_that_cannot_be_is_refused(until: float, evaluated: str | None, says: str) -> None:
    config = resolved(load_scene("en50318_2002"))
    with pytest.raises(InputError, match=says):
        extended_scene(config, "run.h5", until, evaluated)
