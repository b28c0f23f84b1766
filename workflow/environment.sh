#!/usr/bin/env bash
# Make the environment in the folder named by the first argument from requirements.lock, unless it is there already.
#
# A stamp with a checksum of the lock, the package's description and the place of the checkout is written last: an
# interrupted installation is begun again, and a finished one costs a few milliseconds and no network.
# PYTHON names the interpreter; without it the first one that is new enough is taken.
set -euo pipefail

folder="$1"
stamp="$folder/installed"
wanted="$( (cat requirements.lock pyproject.toml; pwd) | cksum)"
enough='import sys; sys.exit(sys.version_info < (3, 11))'

if [[ -x "$folder/bin/python" && -f "$stamp" && "$(cat "$stamp")" == "$wanted" ]]; then
    exit 0
fi

python=""
candidates=("${PYTHON:-python3}")
[[ -n "${PYTHON:-}" ]] || candidates+=(python3.13 python3.12 python3.11)
for candidate in "${candidates[@]}"; do
    if command -v "$candidate" >/dev/null && "$candidate" -c "$enough" 2>/dev/null; then
        python="$candidate"
        break
    fi
done
if [[ -z "$python" ]]; then
    found="$("${PYTHON:-python3}" --version 2>/dev/null || echo nothing)"
    echo "error: PYTHON='${PYTHON:-python3}' is $found but must be Python >= 3.11, for example:" \
        "make study PYTHON=/usr/bin/python3.12" >&2
    exit 1
fi
if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    echo "error: '$python' cannot make environments; install its venv module (Debian: python3-venv)" >&2
    exit 1
fi

echo "Setting up the environment in $folder with $("$python" --version): a minute or two, once" >&2
unset XDG_CACHE_HOME # downloads belong into the user's cache, not into the checkout
rm -f "$stamp"
"$python" -m venv --clear "$folder"
pip=("$folder/bin/python" -m pip --disable-pip-version-check -qq)
if ! "${pip[@]}" install --require-hashes --requirement requirements.lock; then
    echo "error: requirements.lock could not be installed; is the package registry within reach?" >&2
    exit 1
fi
"${pip[@]}" install --no-deps --no-build-isolation --no-index --editable .
echo "$wanted" >"$stamp"
