#!/usr/bin/env bash
# Sets up .venv where needed and runs the tests; arguments go to pytest: ./test.sh -k map
set -euo pipefail
CDPATH='' cd "$(dirname "${BASH_SOURCE[0]}")"
launch/setup.sh
. launch/environment.sh
# From here pytest imports the source tree, so that what a traceback names can be edited; the executables that tests
# start are the installed ones, which the set-up has just made the same.
exec python -m pytest "$@"
