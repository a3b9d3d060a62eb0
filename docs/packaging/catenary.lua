-- A module of Lmod for a checkout on a cluster in which `make setup` was run. Set `root`, and put
-- the file at <modules>/catenary/0.2.0.lua. The modules that setup found have to be loaded too.
help([[Catenary: finite elements for railway overhead lines coupled with pantographs.
    srun catenary run CASE -o DIR
    catenary submit CASE -o DIR --ranks 32 --nodes 1]])
whatis("Name: Catenary")
whatis("Version: 0.2.0")

local root = "/opt/catenary"

depends_on("petsc4py", "mpi4py", "h5py")
prepend_path("PATH", pathJoin(root, ".venv/bin"))
setenv("OMP_NUM_THREADS", "1")
setenv("OPENBLAS_NUM_THREADS", "1")
