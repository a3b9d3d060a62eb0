"""Versions that were tested together: one file for each Python, ``tested/pythonX.Y.txt``.

``versions.py write`` makes the file anew from what is installed; ``versions.py is-tested`` ends
with 0 if there is one for this Python, else with 1.
"""

import platform
import re
import sys
import sysconfig
from importlib.metadata import distributions
from pathlib import Path

SITE = Path(sysconfig.get_path("purelib"))
TESTED = Path(__file__).parent / "tested" / "python{}.{}.txt".format(*sys.version_info)
SYSTEM_MARK = "# system: "
NOT_OURS = {"catenary", "pip"}


def versions_in(folder: Path) -> dict[str, str]:
    """Version of each distribution in a folder, by its normalised name."""
    found = {}
    for distribution in distributions(path=[str(folder)]):
        # Debian's builds of h5py are called h5py._debian_h5py_mpi and h5py._debian_h5py_serial.
        name = re.split(r"\.[-_]debian", distribution.metadata["Name"])[0]
        found[re.sub(r"[-_.]+", "-", name).lower()] = distribution.version
    return {name: found[name] for name in sorted(found) if name not in NOT_OURS}


def tested() -> dict[str, str]:
    """Versions in the file for this Python, packages of the system included; empty without one."""
    if not TESTED.is_file():
        return {}
    lines = TESTED.read_text().splitlines()
    pins = [line.removeprefix(SYSTEM_MARK) for line in lines]
    return dict(pin.split("==") for pin in pins if "==" in pin)


def remark() -> str:
    """One sentence on what differs from the tested versions, empty if nothing does.

    The packages of tests may be absent.
    """
    wanted = tested()
    if not wanted:
        return (
            f"No versions were tested with Python {platform.python_version()}: these are the "
            "newest that pyproject.toml allows."
        )
    there = versions_in(SITE) | versions_in(SITE.with_name("system-packages"))
    other = [
        f"{name} {version} (tested: {wanted.get(name, 'absent')})"
        for name, version in sorted(there.items())
        if version != wanted.get(name)
    ]
    return f"Other than the tested versions: {', '.join(other)}." if other else ""


def write() -> None:
    """Make the file of this Python anew."""
    try:
        system = platform.freedesktop_os_release()["PRETTY_NAME"]
    except OSError:
        system = platform.platform()
    lines = [
        f"# Versions with which all tests passed: Python {platform.python_version()}, {system}.",
        "# Written by `make update-versions`; `make setup` installs exactly these.",
        *(
            f"{SYSTEM_MARK}{name}=={version}"
            for name, version in versions_in(SITE.with_name("system-packages")).items()
        ),
        *(f"{name}=={version}" for name, version in versions_in(SITE).items()),
    ]
    TESTED.parent.mkdir(exist_ok=True)
    TESTED.write_text("\n".join(lines) + "\n")
    print(f"{TESTED.relative_to(Path.cwd())}: {len(lines) - 2} packages")


if __name__ == "__main__" and sys.argv[1:] == ["write"]:
    write()
if __name__ == "__main__" and sys.argv[1:] == ["is-tested"]:
    sys.exit(not TESTED.is_file())
