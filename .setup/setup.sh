#!/usr/bin/env bash
# Sets up .venv with everything that Catenary needs; called by `make setup`, safe to repeat. With
# --tests also what its tests, lint and documentation need: half of the packages.
#
# Debian and Ubuntu: PETSc, MPI, HDF5, gmsh's shared libraries and a C++ compiler come from apt, the
# rest from the package index. Elsewhere (clusters, conda) the python3 on the PATH must bring
# petsc4py, mpi4py and h5py, and a C++ compiler must be there. Either way the environment sees five
# packages of the system and no others. Bounds of versions stand in pyproject.toml, the tested ones
# in .setup/tested; --newest disregards those. The kernels are compiled again when they changed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# a|b: either will do, a is installed if none is there. The module h5py that chooses between the
# serial and the MPI build lies in python3-h5py since Debian 13, in python3-h5py-serial before.
# gmsh's wheel links to these libraries of OpenGL and X (ldd libgmsh.so), though no window is opened.
# WeasyPrint, which writes reports as PDF, loads Pango and HarfBuzz.
DEBIAN_PACKAGES=(
    python3-petsc4py-real python3-mpi4py python3-h5py-mpi "python3-h5py|python3-h5py-serial"
    python3-scipy python3-numpy openmpi-bin python3-venv make
    libglu1-mesa libgl1 libegl1 libxrender1 libxcursor1 libxfixes3 libxext6 libxft2 libfontconfig1
    libxinerama1 libx11-6 libgomp1
    libpango-1.0-0 libpangoft2-1.0-0 libharfbuzz-subset0 fonts-dejavu-core
    g++ python3-dev
)
STAMP=.venv/catenary-setup
TESTS_STAMP=.venv/catenary-tests
KERNELS_STAMP=.venv/catenary-kernels

say() { printf '%s\n' "$*" >&2; }

# begin WORDS [HINT]: say what is done from now on, and every 15 s how long it has taken so far.
begin() {
    finish
    step=$1 step_begin=$SECONDS
    say "setup: $step${2:+ ($2)} ..."
    (
        # A sleep that outlives the script must hold neither of its outputs: whoever reads them
        # through a pipe would wait for it.
        while sleep 15 >/dev/null 2>&1; do
            say "setup:   $step, $((SECONDS - step_begin)) s so far"
        done
    ) &
    ticker=$!
    disown "$ticker" # bash says nothing of its end
}

# finish: end what was begun, and say how long it took.
finish() {
    [ -n "$ticker" ] || return 0
    kill -KILL "$ticker" 2>/dev/null || true
    ticker=
    say "setup:   $((SECONDS - step_begin)) s"
}

# Files to remove, and the ticker to end, however this script ends.
work=
ticker=
clean_up() {
    [ -z "$ticker" ] || kill -KILL "$ticker" 2>/dev/null || true
    [ -z "$work" ] || rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 130' INT # pip catches it, and would pass for one that lacks a version

fail() {
    say "setup: $*"
    exit 1
}

# --- is there anything to do? ------------------------------------------------------------------

# What the environment was made from; the folder is in it because scripts of a venv hold its path.
fingerprint() {
    printf '%s\n' "$PWD"
    cat pyproject.toml setup.py .setup/*.* .setup/tested/* | cksum
}

is_current() {
    local wanted stamp
    wanted=$(fingerprint)
    for stamp in "$STAMP" ${tests:+"$TESTS_STAMP"}; do
        [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ] || return
    done
    .venv/bin/python -c 'import petsc4py, mpi4py, catenary.base.errors' 2>/dev/null
}

# What the kernels are compiled from; their order and names too.
fingerprint_of_kernels() {
    printf '%s\n' solver/kernels/*/*.[ch]pp
    cat setup.py solver/kernels/*/*.[ch]pp | cksum
}

kernels_are_current() {
    [ -f "$KERNELS_STAMP" ] && [ "$(cat "$KERNELS_STAMP")" = "$(fingerprint_of_kernels)" ] &&
        [ -d build/kernels ] && compgen -G 'solver/kernels/native.*.so' >/dev/null
}

# --- Debian and Ubuntu -------------------------------------------------------------------------

is_installed() {
    [[ $(dpkg-query -W -f='<${db:Status-Status}>' "$1" 2>/dev/null) == *"<installed>"* ]]
}

# Names under which a wanted package may be found, one a line. Some libraries carry another name
# since the change to 64-bit time (Ubuntu 24.04, Debian 13).
names_of() {
    local name
    for name in ${1//|/ }; do
        printf '%s\n' "$name" "${name}t64"
    done
}

is_provided() {
    local name
    for name in $(names_of "$1"); do
        is_installed "$name" && return
    done
    return 1
}

name_in_archive() {
    local name
    for name in $(names_of "$1"); do
        # No pipe into grep -q: it would end apt-cache early, which pipefail takes for a failure.
        if [[ $(apt-cache policy "$name" 2>/dev/null) =~ Candidate:\ [^\(] ]]; then
            printf '%s\n' "$name"
            return
        fi
    done
    fail "the package archive of this system has no $1; add its main component (on Ubuntu: universe)"
}

missing_packages() {
    local name
    for name in "${DEBIAN_PACKAGES[@]}"; do
        is_provided "$name" || printf '%s\n' "$name"
    done
}

as_root() {
    if [ "$(id -u)" = 0 ]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    else
        sudo env DEBIAN_FRONTEND=noninteractive "$@"
    fi
}

may_install() {
    [ "$(id -u)" = 0 ] && return
    command -v sudo >/dev/null || return
    # A password can only be asked for at a terminal.
    [ -t 0 ] || sudo -n true 2>/dev/null
}

# Run a command without its chatter, which is shown when it fails.
quietly() {
    local output
    output=$("$@" 2>&1 </dev/null) || {
        say "$output"
        return 1
    }
}

install_packages() {
    local name
    local -a names=()
    begin "installing $# system packages with apt-get" "some 30 s"
    quietly as_root apt-get update || fail "apt-get update failed"
    for name in "$@"; do
        name=$(name_in_archive "$name")
        names+=("$name")
    done
    quietly as_root apt-get install -y --no-install-recommends -o DPkg::Lock::Timeout=120 \
        "${names[@]}" || fail "apt-get could not install: ${names[*]}"
    finish
}

# Folder that holds the petsc4py of the newest installed PETSc: Debian keeps it out of sys.path.
petsc_folder() {
    dpkg-query -W -f='${db:Status-Status} ${Package}\n' 'python3-petsc4py-real*' |
        sed -n 's/^installed //p' | xargs dpkg -L | grep '/petsc4py/__init__\.py$' |
        sort -V | tail -n 1 | sed 's|/petsc4py/__init__\.py$||'
}

# --- other systems -----------------------------------------------------------------------------

has_everything() {
    command -v "$1" >/dev/null && "$1" -c 'import petsc4py, mpi4py, h5py, numpy, scipy, venv' 2>/dev/null
}

# What to do, given the names of missing packages where there is apt.
explain() {
    say "setup: python3 on the PATH does not bring petsc4py, mpi4py and h5py, which Catenary needs."
    if [ $# -gt 0 ]; then
        say "  Here:            apt-get install --no-install-recommends ${*%%|*}"
    fi
    cat >&2 <<'TEXT'
  Debian, Ubuntu:  run `make setup` as root or as a user who may use sudo.
  conda-forge:     conda create -n catenary -c conda-forge python petsc petsc4py mpi4py h5py scipy gmsh make cxx-compiler
                   conda activate catenary, then make setup
  Cluster:         load the modules of PETSc with petsc4py, mpi4py and h5py for one Python, typically
                   module load petsc4py mpi4py h5py      (or: petsc, python, h5py-mpi)
                   and check: python3 -c "import petsc4py, mpi4py, h5py"; then make setup
TEXT
    exit 1
}

# --- steps -------------------------------------------------------------------------------------

# Sets `python` (the interpreter to build on) and `extra_path` (PETSc's folder, empty if not needed).
# Debian's runs isolated (-I); elsewhere PYTHONPATH or the user's folder may bring the packages.
choose_python() {
    local -a missing=()
    python=(python3)
    extra_path=
    if command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; then
        mapfile -t missing < <(missing_packages)
        if [ "${#missing[@]}" -gt 0 ] && may_install; then
            install_packages "${missing[@]}"
            missing=()
        fi
        if [ "${#missing[@]}" = 0 ]; then
            python=(/usr/bin/python3 -I)
            extra_path=$(petsc_folder)
            [ -n "$extra_path" ] || fail "dpkg lists no petsc4py in python3-petsc4py-real"
            return
        fi
    fi
    has_everything "${python[0]}" || explain "${missing[@]}"
}

make_environment() {
    # A half-made or moved environment is not worth repairing, nor one that sees all of the system.
    if [ ! -f "$STAMP" ] || [ "$(head -n 1 "$STAMP")" != "$PWD" ] ||
        ! .venv/bin/python -m pip --version >/dev/null 2>&1 ||
        ! grep -q '^include-system-site-packages = false' .venv/pyvenv.cfg; then
        begin "making the virtual environment .venv" "some 5 s"
        rm -rf .venv
        "${python[@]}" -m venv .venv
        finish
    fi
    rm -f "$STAMP" "$TESTS_STAMP"
    "${python[@]}" .setup/system_packages.py .venv ${extra_path:+"$extra_path"}
}

# Run by the environment's Python without the user's PYTHONPATH and folder, nor do its children see them.
pip_install() {
    env -u PYTHONPATH .venv/bin/python -I -m pip install --quiet --no-input --disable-pip-version-check \
        --no-compile "$@" >&2
}

# setup.py compiles what changed, and keeps its objects in build/kernels.
compile_kernels() {
    local output from
    from=$(fingerprint_of_kernels)
    begin "compiling the kernels" "${1-}"
    output=$(env -u PYTHONPATH .venv/bin/python -I setup.py --quiet build_ext --inplace 2>&1 </dev/null) || {
        say "$output"
        fail "the kernels could not be compiled. They need a C++20 compiler (GCC 12 or newer," \
            "Clang 16 or newer; CXX=... names another than the usual one) and the headers of Python."
    }
    [[ $output != *warning:* ]] || say "$output"
    finish
    printf '%s\n' "$from" >"$KERNELS_STAMP"
}

install_python_packages() {
    local tested
    work=$(mktemp -d)
    .venv/bin/python -I .setup/requirements.py pyproject.toml $tests >"$work/requirements.txt"
    # petsc4py and h5py are compiled against the system's numpy: nothing may bring another one.
    .venv/bin/python -I - >"$work/system.txt" <<'CODE'
import numpy
import scipy

print(f"numpy=={numpy.__version__}\nscipy=={scipy.__version__}")
CODE
    local -a wanted=(--requirement "$work/requirements.txt" --constraint "$work/system.txt")
    tested=.setup/tested/$(.venv/bin/python -I -c \
        'import sys; print("python{}.{}.txt".format(*sys.version_info))')
    begin "installing Python packages into .venv" "some 30 s"
    if [ "$newest" ]; then
        pip_install --upgrade --upgrade-strategy eager "${wanted[@]}"
    elif [ -f "$tested" ]; then
        pip_install "${wanted[@]}" --constraint "$tested" || {
            say "setup: the versions of $tested cannot be had here; taking what pyproject.toml allows"
            pip_install "${wanted[@]}"
        }
    else
        pip_install "${wanted[@]}"
    fi
    compile_kernels "some two minutes"
    pip_install --no-deps --no-build-isolation --editable .
    begin "compiling the packages and the program to bytecode"
    # Bytecode on all cores at once: pip makes it on one, which took a third of its time. Packages
    # may bring files that are no Python of this version.
    .venv/bin/python -I -m compileall -q -j 0 cases mbs meshgen postproc solver \
        "$(.venv/bin/python -I -c 'import sysconfig; print(sysconfig.get_path("purelib"))')" >/dev/null || true
    # -E: the program reads the environment's packages, not those of the user's PYTHONPATH. In the
    # second line the interpreter stands if its path is too long for the first.
    sed -i -E "1s|^(#!.*/python[0-9.]*)\$|\1 -E|; 2s|^('''exec' .*/python[^ ]*) |\1 -E |" \
        .venv/bin/catenary
}

newest=
tests=
case "${1-}" in
"") ;;
--tests) tests=tests ;;
--newest) newest=yes tests=tests ;;
*) fail "unknown option $1; there are --tests and --newest" ;;
esac
if [ ! "$newest" ] && is_current; then
    kernels_are_current || compile_kernels
    exit 0
fi
say "setup: preparing .venv, which takes two to five minutes the first time"
choose_python
make_environment
install_python_packages
begin "checking that all packages load"
.venv/bin/python -I .setup/check.py >&2
finish
[ -z "$tests" ] || fingerprint >"$TESTS_STAMP"
fingerprint >"$STAMP"
say "setup: ready after $SECONDS s"
