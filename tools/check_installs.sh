#!/usr/bin/env bash
# Installs the project in four ways into temporary folders (pip install, pip install -e, colcon build,
# colcon build --symlink-install) and tries each from another working directory: are the shipped data
# found, does the command run, does a node start and stop, does the whole graph work? The dependencies are
# those of .venv.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tools/setup.sh

readonly project=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/elsewhere"
export ROS_DOMAIN_ID=$((1 + RANDOM % 101)) PIP_DISABLE_PIP_VERSION_CHECK=1
unset PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE

# What the ROS wheels put into the environment of their own virtual environment; in others they cannot.
libraries=$(.venv/bin/python -c 'import os; print(os.environ.get("LD_LIBRARY_PATH", ""))')
site=$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')

copy_source() { # folder
    mkdir -p "$1"
    tar -C "$project" --exclude=./.venv --exclude=./.git --exclude=./build --exclude=./install --exclude=./log \
        --exclude=./runs --exclude='*.egg-info' --exclude=__pycache__ -cf - . | tar -C "$1" -xf -
}

# Sees the dependencies of .venv, but as a plain path, so that its editable install stays out of sight.
make_environment() { # folder
    .venv/bin/python -m venv --without-pip "$1"
    echo "$site" >"$("$1/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/dependencies.pth"
}

# The files for ROS's own tools, which an installation has beside the package.
check_share() { # prefix
    local file
    for file in ament_index/resource_index/packages/ros_scenesense ros_scenesense/package.xml \
        ros_scenesense/config/scenesense.yaml ros_scenesense/launch/scenesense.launch.py; do
        [ -e "$1/share/$file" ] || { echo "$1/share/$file is missing" && exit 1; }
    done
}

try() { # python, folder of the package, folder of the executables
    (cd "$work/elsewhere" && LD_LIBRARY_PATH=$libraries _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 \
        "$1" "$project/tools/try_install.py" "$2" "$3")
}

# --no-index: whatever setup.py asks for must be in the lock already.
try_pip() { # name, option of pip...
    local environment=$work/$1 source=$work/$1-source
    echo "pip install ${*:2}${2:+ }.[ros]"
    make_environment "$environment"
    copy_source "$source"
    LD_LIBRARY_PATH=$libraries _ROS_WHEELS_BOOTSTRAP_COMPLETE=1 "$environment/bin/python" -m pip \
        --quiet install --no-index --no-build-isolation "${@:2}" "$source[ros]"
    if [ "$1" = editable ]; then
        try "$environment/bin/python" "$source" "$environment/bin"
    else
        check_share "$environment"
        try "$environment/bin/python" "$environment" "$environment/bin"
    fi
}

try_colcon() { # name, option of colcon...
    local workspace=$work/$1
    echo "colcon build${2:+ }${*:2}"
    copy_source "$workspace/src/ros_scenesense"
    (
        cd "$workspace"
        PATH=$work/colcon/bin:$PATH colcon --log-level error build --event-handlers console_direct- "${@:2}" >build.txt 2>&1 ||
            { cat build.txt && exit 1; }
        set +u
        # shellcheck disable=SC1091
        source install/setup.bash
        set -u
        check_share "$workspace/install/ros_scenesense"
        local where=$workspace/install
        [ "$1" = colcon-plain ] || where=$workspace/src
        try "$work/colcon/bin/python" "$where" "$workspace/install/ros_scenesense/lib/ros_scenesense"
    )
}

try_pip plain
try_pip editable --editable
make_environment "$work/colcon"
"$work/colcon/bin/python" -m pip --quiet install colcon-core colcon-ros colcon-common-extensions 'setuptools<80'
try_colcon colcon-plain
try_colcon colcon-symlink --symlink-install
echo "all four installations work"
