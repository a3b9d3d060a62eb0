"""Maps the five folders of the repository into the namespace package ``catenary``."""

from setuptools import find_packages, setup

PARTS = ("meshgen", "solver", "mbs", "postproc", "cases")

setup(
    packages=[
        f"catenary.{package}"
        for part in PARTS
        for package in (part, *(f"{part}.{inner}" for inner in find_packages(part)))
    ],
    package_dir={f"catenary.{part}": part for part in PARTS},
    package_data={
        "catenary.cases": [
            "*/case.toml",
            "*/README.md",
            "*/reference/*.csv",
            "*/study.toml",
            "studies/hard/hard.toml",
            "*/*.py",
        ],
        "catenary.postproc": ["report/templates/*", "paraview/*.template"],
    },
)
