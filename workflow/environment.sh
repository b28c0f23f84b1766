#!/usr/bin/env bash
# Make the environment in the folder named by the first argument from requirements.lock, unless it is there already.
#
# A stamp with a checksum of the lock, the package's description and the place of the checkout is written last: an
# interrupted installation is begun again, and an unchanged one costs a few milliseconds and no network.
set -euo pipefail

folder="$1"
python="${PYTHON:-python3}"
stamp="$folder/installed"
wanted="$( (cat requirements.lock pyproject.toml; pwd) | cksum)"

if [[ -x "$folder/bin/python" && -f "$stamp" && "$(cat "$stamp")" == "$wanted" ]]; then
    exit 0
fi

if ! command -v "$python" >/dev/null; then
    echo "error: there is no '$python'; name a Python >= 3.11, for example: make study PYTHON=/usr/bin/python3.12" >&2
    exit 1
fi
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    echo "error: '$python' is $("$python" --version 2>&1) but must be Python >= 3.11;" \
        "name another one, for example: make study PYTHON=python3.12" >&2
    exit 1
fi
if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    echo "error: '$python' cannot make environments; install its venv module (Debian: python3-venv)" >&2
    exit 1
fi

echo "Setting up the environment in $folder (about a minute, once)" >&2
rm -f "$stamp"
"$python" -m venv --clear "$folder"
pip=("$folder/bin/python" -m pip --disable-pip-version-check --quiet)
if ! "${pip[@]}" install --require-hashes --requirement requirements.lock; then
    echo "error: the packages of requirements.lock could not be installed; the package registry must be reachable" >&2
    exit 1
fi
"${pip[@]}" install --no-deps --no-build-isolation --no-index --editable .
echo "$wanted" >"$stamp"
