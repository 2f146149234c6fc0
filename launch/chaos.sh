#!/usr/bin/env bash
# Runs a fleet on three hosts of this machine, once for each way in which networks and processes fail, and prints a
# table. Needs root and /dev/net/tun; leaves no process, namespace or file outside out/ behind.
#
#     launch/chaos.sh [--scene FILE] [--seed N] [--only WORDS] [--out DIR]
#
# Rows that have ended are in DIR/rows.jsonl and are not run again; remove it to begin anew. DIR: out/chaos by default
set -euo pipefail
here=$(CDPATH='' cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
"$here/setup.sh"
. "$here/environment.sh"
exec python "$here/../test/chaos/chaos.py" "$@"
