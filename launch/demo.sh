#!/usr/bin/env bash
# Four robots cross the depot: map server, grid planner, four robots and the world sim as processes over ROS 2.
#
#     launch/demo.sh [--out DIR]       DIR, out/demo by default, gets report.json and mission.png
set -euo pipefail
here=$(CDPATH='' cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
root=$(dirname "$here")
if (($#)) && [[ $1 != --out || $# != 2 ]]; then
    echo 'usage: launch/demo.sh [--out DIR]' >&2
    exit 2
fi
exec "$here/fleet.sh" "$root/config/fleets/crossing.yaml" --out "${2:-$root/out/demo}"
