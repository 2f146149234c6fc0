#!/usr/bin/env bash
# Sets up .venv where needed and runs the tests in two processes; arguments go to pytest: ./test.sh -k map; with
# -n 0 they run in one process, where a debugger works.
set -euo pipefail
CDPATH='' cd "$(dirname "${BASH_SOURCE[0]}")"
launch/setup.sh
. launch/environment.sh
# From here pytest imports the source tree, so that what a traceback names can be edited; the executables that tests
# start are the installed ones, which the set-up has just made the same.
exec python -m pytest -n 2 "$@"
