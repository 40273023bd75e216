#!/usr/bin/env bash
# Bring this machine to where avneo_fem runs: Debian packages, then .venv. Called by every make
# target that needs it; when nothing is missing it installs nothing and takes a fraction of a second.
#
# An interrupted run is repaired by the next one: the stamp is removed before .venv is touched and
# written last, and a .venv without a stamp is rebuilt.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# DOLFINx, PETSc, gmsh and mpi4py have no wheels that fit together, so they are Debian's, and with
# them NumPy and SciPy, which they are compiled against. OpenBLAS makes MUMPS 3-5 times faster;
# without libegl1 an off-screen picture ends in a segmentation fault.
readonly packages=(
    make python3-dolfinx python3-gmsh python3-meshio python3-scipy python3-venv
    libopenblas0-pthread libegl1
)
# Distributions that pip must take from Debian and never put a wheel over.
readonly from_debian=(numpy scipy mpi4py petsc4py)
readonly debian_python=/usr/bin/python3 # not the python3 on PATH: it may be another
readonly venv=.venv
readonly stamp=$venv/.setup-stamp
readonly work=build/setup # logs, constraints, lock

export PYTHONNOUSERSITE=1 LC_ALL=C.UTF-8
unset PYTHONPATH PYTHONHOME PIP_USER PIP_TARGET PIP_PREFIX PIP_ROOT PIP_REQUIRE_VIRTUALENV

say() { printf 'set-up: %s\n' "$*"; }

fail() {
    printf 'set-up: error: %s\n' "$*" >&2
    exit 1
}

# run_logged LOG COMMAND...: run quietly; on failure show the end of the log.
run_logged() {
    local log=$1
    shift
    if ! "$@" >"$log" 2>&1 </dev/null; then
        tail -n 25 "$log" >&2
        fail "'${*:1:6} ...' failed; the whole log is $log"
    fi
}

missing_packages() {
    local installed name
    installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${packages[@]}" 2>/dev/null) ||
        true # it also fails when one name is unknown
    for name in "${packages[@]}"; do
        grep -qx "installed $name" <<<"$installed" || printf '%s\n' "$name"
    done
}

install_packages() {
    local -a missing as_root=()
    command -v dpkg-query >/dev/null && command -v apt-get >/dev/null ||
        fail "this needs Debian 12: no apt-get and dpkg-query here"
    mapfile -t missing < <(missing_packages)
    [ "${#missing[@]}" -gt 0 ] || return 0
    # shellcheck source=/dev/null
    [ "$(. /etc/os-release && printf '%s' "${ID:-}")" = debian ] ||
        fail "this needs Debian 12; packages missing here: ${missing[*]}"
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null ||
            fail "neither root nor sudo: ask an administrator to run" \
                "'apt-get install --no-install-recommends ${missing[*]}'"
        as_root=(sudo)
        if ! sudo -n true 2>/dev/null; then
            [ -t 0 ] || fail "not root, and sudo without a password is refused; packages missing:" \
                "${missing[*]}"
            sudo -v || fail "sudo refused; packages missing: ${missing[*]}"
        fi
    fi
    local -a apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 apt-get -y
        -o DPkg::Lock::Timeout=600 -o Acquire::Retries=3 -o APT::Keep-Downloaded-Packages=false)
    local began=$SECONDS
    say "Debian packages missing: ${missing[*]} (a few minutes)"
    run_logged "$work/apt-update.log" "${apt[@]}" update
    if [ -n "$(dpkg --audit)" ]; then
        say "repairing an interrupted installation of packages"
        # It may stop at a package whose dependencies were never unpacked: apt-get fetches them.
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive dpkg --configure -a --force-confold \
            >"$work/dpkg.log" 2>&1 </dev/null || true
        run_logged "$work/apt-fix.log" "${apt[@]}" install --fix-broken --no-install-recommends
    fi
    run_logged "$work/apt-install.log" "${apt[@]}" install --no-install-recommends "${missing[@]}"
    sed -n -E 's/^(.*newly installed).*|^(Need to get .*)|^(After this operation.*)/set-up:   \1\2\3/p' \
        "$work/apt-install.log"
    say "Debian packages installed in $((SECONDS - began)) s"
}

# What .venv depends on. First line: what it is built on (a change rebuilds it; a venv cannot be
# moved, so the directory counts). Second line: what is installed into it (a change updates it).
wanted_stamp() {
    { pwd -P && dpkg-query -W python3-minimal python3-numpy python3-scipy; } | sha256sum
    cat pyproject.toml .ci/setup.sh | sha256sum
}

venv_runs() {
    "$venv/bin/python" -I -c 'import importlib.metadata as m; m.version("avneo_fem")' 2>/dev/null &&
        [ -x "$venv/bin/avneo" ]
}

make_venv() {
    local began=$SECONDS
    if venv_runs && [ -f "$stamp" ] && [ "$(head -n 1 "$stamp")" = "$(wanted_stamp | head -n 1)" ]; then
        say "updating $venv"
        rm -f "$stamp"
    else
        say "building $venv (a minute or two)"
        rm -rf "$venv"
        run_logged "$work/venv.log" "$debian_python" -m venv --system-site-packages "$venv"
    fi
    "$debian_python" -I - "${from_debian[@]}" >"$work/constraints.txt" <<'PYTHON'
import importlib.metadata
import sys

for name in sys.argv[1:]:
    print(f"{name}=={importlib.metadata.version(name)}")
PYTHON
    run_logged "$work/pip.log" "$venv/bin/python" -m pip install --no-user --no-input \
        --progress-bar off -c "$work/constraints.txt" -e '.[test,viz]'
    "$venv/bin/python" -I - "${from_debian[@]}" <<'PYTHON' || fail "pip put its own over Debian's"
import importlib.util
import sys

for name in sys.argv[1:]:
    origin = importlib.util.find_spec(name).origin
    if origin.startswith(sys.prefix + "/"):
        sys.exit(f"{name} comes from {origin}")
PYTHON
    wanted_stamp >"$stamp.new"
    mv -f "$stamp.new" "$stamp"
    say "$venv ready in $((SECONDS - began)) s: $("$venv/bin/python" -m pip list --local \
        --format=freeze 2>/dev/null | wc -l) wheels, $(du -sm "$venv" | cut -f1) MB"
}

up_to_date() {
    [ -f "$stamp" ] && [ "$(<"$stamp")" = "$(wanted_stamp)" ] && venv_runs
}

mkdir -p "$work"
exec 9>"$work/lock"
flock -n 9 || {
    say "another set-up is running here; waiting for it"
    flock 9
}
install_packages 9>&- # a service started by a package must not keep our lock
up_to_date || make_venv
