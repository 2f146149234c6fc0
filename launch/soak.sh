#!/usr/bin/env bash
# Lets robots drive from goal to goal for minutes on end, a process each over ROS 2, and prints whether memory stays flat.
#
#     launch/soak.sh [--minutes N] [--robots N] [--limit KB_PER_MINUTE]         logs: out/soak
set -euo pipefail
here=$(CDPATH='' cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
"$here/setup.sh"
. "$here/environment.sh"
cd "$here/.."
exec python -m benchmark.fleet_soak "$@"
