#!/usr/bin/env bash
# Writes requirements.lock: everything that setup.py asks for, and what that needs, in exact versions, for
# Python 3.11 and 3.12. Versions that still fit are kept; `tools/lock.sh --upgrade` takes the newest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"${PYTHON:-.venv/bin/python}" -m venv "$work/venv"
"$work/venv/bin/pip" --quiet install uv==0.13.9

[ ! -f requirements.lock ] || cp requirements.lock "$work/"
"$work/venv/bin/uv" --quiet --config-file tools/lock.toml pip compile --python "$work/venv/bin/python" \
    --universal --python-version 3.11 --extra ros --extra cluster --extra test --no-annotate --no-header "$@" \
    --output-file "$work/requirements.lock" setup.py >/dev/null
{
    cat <<'HEADER'
# Every Python dependency, also the indirect ones, for Python 3.11 and 3.12. Made by `make lock`.
#
# torch stands here without a suffix and without its NVIDIA packages: pip takes the build that your
# configuration offers (CPU or CUDA), and the CUDA build pins the packages it needs itself.
HEADER
    cat "$work/requirements.lock"
} >requirements.lock
