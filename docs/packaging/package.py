"""Catenary as a package of Spack: put this file at packages/catenary/package.py of a repository."""

from spack.package import *


class Catenary(PythonPackage):
    """Parallel finite elements for railway overhead lines coupled with pantographs."""

    license("BSD-3-Clause AND CC-BY-4.0")

    # A checkout: spack dev-build catenary@main
    version("main", branch="main")

    depends_on("cxx", type="build")
    depends_on("python@3.11:3.13", type=("build", "run"))
    depends_on("py-setuptools@77:", type="build")
    depends_on("py-pybind11@3", type="build")

    with default_args(type=("build", "run")):
        depends_on("py-numpy@1.24:2")
        depends_on("py-scipy@1.10:1")
        depends_on("py-h5py@3.7:3 +mpi")
        depends_on("py-mpi4py@3.1:4")
        depends_on("py-petsc4py@3.18:3")
        depends_on("py-meshio@5.3:5")
        depends_on("py-pydantic@2.6:2.14")
        depends_on("py-typer@0.12:0.29")
        depends_on("py-rich@13:15")
        depends_on("py-tqdm@4.64:4")
        depends_on("py-jinja2@3.1:3")
        depends_on("py-matplotlib@3.7:3.11")
        depends_on("py-xarray@2023.1:2026")
        depends_on("py-pandas@1.5:3")
        depends_on("py-salib@1.4.7:1")
        depends_on("py-tomli-w@1:1")
        depends_on("py-cma@4:4")

    # Its module for Python, gmsh.py, lies beside the library.
    depends_on("gmsh@4.11:4.15 +shared", type=("build", "run"))
    depends_on("petsc@3.18:3 +mpi +mumps", type=("build", "run"))

    def setup_run_environment(self, env):
        """One thread a rank, and the place of gmsh.py."""
        env.set("OMP_NUM_THREADS", "1")
        env.prepend_path("PYTHONPATH", self.spec["gmsh"].prefix.lib)
