#!/usr/bin/env bash
# Makes .venv in the project folder: system libraries, virtual environment, locked dependencies, and the
# project itself (editable). A finished set-up is recognised in a moment; an interrupted one is repaired.
#
#   PYTHON=/path/to/python tools/setup.sh     with this interpreter (3.11 or 3.12)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# What another environment left behind must not leak into ours.
unset PYTHONPATH PYTHONHOME VIRTUAL_ENV PIP_USER PIP_TARGET PIP_PREFIX PIP_NO_DEPS
[ -z "${_ROS_WHEELS_BOOTSTRAP_COMPLETE:-}" ] || unset LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE

readonly venv=.venv
readonly stamp=$venv/.scenesense-setup # "unfinished", or the key of what was set up
readonly log=$venv/setup.log

say() { printf 'setup: %s\n' "$*"; }

fail() {
    printf 'setup: %s\n' "$@" >&2
    exit 1
}

# Prints e.g. 3.11.7 if the interpreter runs (a pyenv shim may exist and not run) and fits.
version_of() {
    "$1" -c 'import sys; print("%d.%d.%d" % sys.version_info[:3])' 2>/dev/null | grep -E '^3\.1[12]\.'
}

find_python() {
    local candidate
    if [ -n "${PYTHON:-}" ]; then
        version_of "$PYTHON" >/dev/null ||
            fail "PYTHON is '$PYTHON', which is not a working Python 3.11 or 3.12"
        printf '%s' "$PYTHON"
        return
    fi
    for candidate in python3.11 /usr/bin/python3.11 python3.12 /usr/bin/python3.12 python3 /usr/bin/python3; do
        if version_of "$candidate" >/dev/null; then
            printf '%s' "$candidate"
            return
        fi
    done
    fail "SceneSense needs Python 3.11 or 3.12, and none was found" \
        "install one (e.g. apt-get install python3.12), or say where it is: make ... PYTHON=/path/to/python"
}

# The set-up is done again when one of these changes, also when the folder was moved.
key_of() { # version
    { cat requirements.lock setup.py setup.cfg tools/setup.sh && printf '%s %s' "$1" "$PWD"; } |
        sha256sum | cut -d ' ' -f 1
}

# Prints the Debian packages that the dependencies need and this machine lacks.
missing_packages() { # python, version
    local python=$1 short=${2%.*} pair
    for pair in libusb-1.0.so.0:libusb-1.0-0 libGL.so.1:libgl1 libgomp.so.1:libgomp1 libX11.so.6:libx11-6; do
        "$python" -c 'import ctypes, sys; ctypes.CDLL(sys.argv[1])' "${pair%:*}" 2>/dev/null ||
            echo "${pair#*:}"
    done
    "$python" -c 'import ensurepip, venv' 2>/dev/null || echo "python$short-venv"
    if [ "$short" = 3.12 ]; then # pybullet is compiled
        command -v g++ >/dev/null || echo build-essential
        "$python" -c '
import pathlib, sys, sysconfig
sys.exit(not (pathlib.Path(sysconfig.get_path("include")) / "Python.h").exists())' ||
            echo "python$short-dev"
    fi
}

install_packages() { # package...
    local by_hand="apt-get install $*" root=()
    say "missing system packages: $*"
    command -v apt-get >/dev/null ||
        fail "there is no apt-get here: install their counterparts by your system's means, then run this again"
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "this needs root, and there is no sudo: run as root: $by_hand"
        root=(sudo)
        say "installing them with sudo, which may ask for your password"
    fi
    "${root[@]}" apt-get -qq -o DPkg::Lock::Timeout=120 update ||
        say "apt-get could not refresh its lists; trying with the old ones"
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -y -o DPkg::Lock::Timeout=120 \
        install --no-install-recommends "$@" ||
        fail "apt-get could not install them (is the network reachable?); run as root: $by_hand"
}

# Turns pip's long output into a short one.
show_progress() { # number of packages
    local count=0 line name
    while IFS= read -r line; do
        case $line in
        Collecting* | Processing*)
            count=$((count + 1))
            if [ -t 1 ]; then
                name=${line#* }
                name=${name%% *}
                printf '\r\033[Ksetup: %d of %d  %.50s' "$count" "$1" "${name##*/}"
            elif [ $((count % 40)) -eq 0 ]; then
                say "fetched $count of $1"
            fi
            ;;
        *"Building wheel for pybullet"*"started"*) say "compiling pybullet ..." ;;
        "Installing collected packages"*)
            [ ! -t 1 ] || printf '\r\033[K'
            say "unpacking them ..."
            ;;
        esac
    done
}

pip_install() {
    "$venv/bin/python" -m pip --disable-pip-version-check install --progress-bar off "$@" 2>&1 | tee -a "$log"
}

install_dependencies() {
    say "installing the locked dependencies (the first time some minutes; $log has the details)"
    pip_install --requirement requirements.lock | show_progress "$(grep -c == requirements.lock)" &&
        pip_install --no-deps --no-build-isolation --editable . >/dev/null &&
        return
    tail -n 15 "$log" >&2
    fail "pip could not install the dependencies (above; all of it in $log)" \
        "is the network reachable, and is there room on the disk? run this again to go on"
}

make_environment() { # python, version
    local packages
    if [ "${2%.*}" = 3.12 ]; then
        say "pybullet has no wheel for Python 3.12: it will be compiled, which takes some minutes and" \
            "needs build-essential and python3-dev (Python 3.11 needs neither)"
    fi
    mapfile -t packages < <(missing_packages "$1" "$2")
    [ ${#packages[@]} -eq 0 ] || install_packages "${packages[@]}"
    say "making $venv with Python $2 ($1)"
    rm -rf $venv
    mkdir $venv
    echo unfinished >$stamp
    "$1" -m venv $venv || fail "$1 could not make a virtual environment in $PWD/$venv"
}

main() {
    # Two set-ups at once (two terminals) take turns.
    exec 9<tools/setup.sh
    flock 9

    [ "$(uname -sm)" = "Linux x86_64" ] ||
        fail "the ROS 2 wheels exist for Linux on x86_64 only, this is $(uname -sm)" \
            "with a ROS 2 Jazzy of your own: pip install --constraint requirements.lock ."
    if [ -e $venv ] && [ ! -e $stamp ]; then
        fail "$PWD/$venv was not made by this script: move it away, then run this again"
    fi

    local python version state
    state=$(cat $stamp 2>/dev/null || echo unfinished)
    python=$venv/bin/python
    version=$(version_of $python || true)
    # pip repairs no half-unpacked package: what was interrupted is made anew.
    if [ "$state" = unfinished ] || [ -z "$version" ] || [ -n "${PYTHON:-}" ]; then
        python=$(find_python)
        if [ "$state" = unfinished ] || [ "$(version_of "$python")" != "$version" ]; then
            version=$(version_of "$python")
            make_environment "$python" "$version"
            state=unfinished
        fi
    fi
    if [ "$state" != "$(key_of "$version")" ]; then
        echo unfinished >$stamp
        install_dependencies
        key_of "$version" >$stamp
        say "ready"
    fi
}

main "$@"
