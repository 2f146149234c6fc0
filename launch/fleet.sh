#!/usr/bin/env bash
# Runs a scene as processes over ROS 2: map server and grid planner where it has a map, a robot each, the world sim.
# Ends by itself, with 0 for a valid mission, 1 for one that is not, 2 for bad usage, 130 or 143 after a signal.
#
#     launch/fleet.sh config/fleets/NAME.yaml [--robots N] [--out DIR]       DIR: out/NAME by default
set -euo pipefail
usage() { sed -n 's/^#  *launch/usage: launch/p' "${BASH_SOURCE[0]}" >&2; exit 2; }

scene='' robots=0 out=''
while (($#)); do
    case $1 in
        --robots) [[ ${2:-} =~ ^[1-9][0-9]{0,8}$ ]] || usage; robots=$2; shift 2 ;;
        --out) [[ -n ${2:-} ]] || usage; out=$2; shift 2 ;;
        -*) usage ;;
        *) [[ -z $scene && -n $1 ]] || usage; scene=$1; shift ;;
    esac
done
[[ -n $scene ]] || usage
[[ -f $scene ]] || { echo "fleet: there is no scene $scene" >&2; exit 2; }

declare -A names=()      # of the processes, by their ids
leashed=()               # before a command: it is to end when this script is killed
! setpriv --pdeathsig TERM true 2> /dev/null || leashed=(setpriv --pdeathsig TERM)

start() {                # start NAME COMMAND...: in the background, with a log of its own
    local label=$1
    shift
    "${leashed[@]}" "$@" > "$out/log/$label.log" 2>&1 &
    names[$!]=$label
}

stop_all() {             # ask once, wait, then insist
    trap '' HUP INT TERM
    local pid deadline=$((SECONDS + 15))
    ((${#names[@]})) || return 0
    kill -TERM "${!names[@]}" 2> /dev/null || true
    for pid in "${!names[@]}"; do
        while kill -0 "$pid" 2> /dev/null && ((SECONDS < deadline)); do
            sleep 0.05
        done
        kill -KILL "$pid" 2> /dev/null && echo "fleet: ${names[$pid]} did not stop and was killed" >&2
        wait "$pid" 2> /dev/null || true
    done
}

here=$(CDPATH='' cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
"$here/setup.sh"
. "$here/environment.sh"
scene=$(realpath "$scene")
name=$(basename "$scene" .yaml)
out=${out:-$(dirname "$here")/out/$name}

trap stop_all EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM

chosen=()
((robots)) && chosen=(--robots "$robots")
# Ctrl-C reaches every process of the terminal; this one would answer with a traceback.
listing=$(trap '' INT; simulate "$scene" --list "${chosen[@]}")
map=$(sed -n 's/^map *//p' <<< "$listing")
ids=$(sed -n 's/^robots *//p' <<< "$listing")

mkdir -p "$out/log" || exit 2
out=$(realpath "$out")
# What an earlier run has left would pass for ours.
rm -f "$out"/{report.json,mission.png} "$out"/log/{map_server,grid_planner,world_sim,robot_*}.log

quoted() { printf "'%s'" "${1//\'/\'\'}"; }      # a string for YAML, which ROS reads parameters as
world=(-p scene:="$(quoted "$scene")" -p scene_robots:="$robots")

echo "fleet: scene $name, robots $ids, ROS_DOMAIN_ID=$ROS_DOMAIN_ID, logs in $out/log"
if [[ -n $map ]]; then
    start map_server map_server --ros-args -p yaml_filename:="$(quoted "$map")"
    start grid_planner grid_planner
fi
for id in $ids; do
    start "robot_$id" robot --ros-args -r __node:="robot_$id" -p robot_id:="$id" "${world[@]}"
done
"${leashed[@]}" world_sim --ros-args "${world[@]}" -p out:="$(quoted "$out")" 2> "$out/log/world_sim.log" &
judge=$!
names[$judge]=world_sim

code=0
wait -n -p ended "${!names[@]}" || code=$?
label=${names[$ended]}
unset "names[$ended]"
if [[ $ended == "$judge" && $code == 0 && -f $out/report.json ]]; then
    exit 0
fi
if [[ $ended != "$judge" || $code != 1 ]]; then
    echo "fleet: $label ended early with exit code $code:" >&2
    tail -n 5 "$out/log/$label.log" >&2
fi
grep -hE '^\[(WARN|ERROR|FATAL)\]' "$out"/log/*.log | tail -n 10 >&2 || true
exit $((code == 2 ? 2 : 1))
