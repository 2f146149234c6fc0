#!/usr/bin/env bash
# Makes .venv in the root of the repository, or brings it up to date: the pinned wheels, the package with its links where
# `ros2 run` looks, the messages and, beside them, the compiled kernels. A step whose inputs are unchanged is skipped; a
# step that was interrupted is done again.
#
#     launch/setup.sh                            with python3, or the first of python3.12 to python3.10 that will do
#     PYTHON=/path/to/python3.12 launch/setup.sh
set -euo pipefail

# What a shell that has sourced another ROS, or stands in another virtual environment, would push in.
unset PYTHONPATH PYTHONHOME LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH PIP_TARGET PIP_PREFIX PIP_USER

CDPATH='' cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$(pwd -P)
venv=$root/.venv
package=(mobile_planning config resource package.xml setup.py setup.cfg)

# Prints what this interpreter is and what it lacks, as version|path|lacks. Any Python must be able to read it.
probe='
import os, sys
lacks = ""
if not (3, 10) <= sys.version_info[:2] <= (3, 12):
    lacks = "version"
else:
    import importlib.util, sysconfig
    if not (importlib.util.find_spec("venv") and importlib.util.find_spec("ensurepip")):
        lacks += "venv "
    if not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")):
        lacks += "headers "
path = os.path.realpath(getattr(sys, "_base_executable", None) or sys.executable)
print("%d.%d.%d|%s|%s" % (sys.version_info[:3] + (path, lacks)))
'

complain() {
    echo "setup: $*" >&2
    complaints=$((complaints + 1))
}

# Sets `python` to the interpreter that .venv is to stand on: the one named by PYTHON, else the one it stands on
# already, else the first that lacks nothing.
choose_python() {
    local candidates=(python3 python3.12 python3.11 python3.10) candidate version path lacks found='' nearest=''
    if [[ -n ${PYTHON:-} ]]; then
        candidates=("$PYTHON")
    elif python=$(cat .venv/stamps/python 2> /dev/null) && [[ -x $python ]]; then
        return
    fi
    for candidate in "${candidates[@]}"; do
        IFS='|' read -r version path lacks < <("$candidate" -c "$probe" 2> /dev/null) || continue
        found+="${found:+, }$candidate is $version"
        if [[ -z $lacks ]]; then
            python=$path
            return
        elif [[ $lacks != version && -z $nearest ]]; then
            nearest="$version|$path|$lacks"
        fi
    done
    if [[ -z $nearest ]]; then
        complain "Python 3.10, 3.11 or 3.12 is needed, but ${found:-there is no ${candidates[0]}}:" \
            'install one (Debian package python3) or name one with PYTHON=/path/to/python.'
        return
    fi
    IFS='|' read -r version path lacks <<< "$nearest"
    if [[ $lacks == *venv* ]]; then
        complain "The modules venv and ensurepip of $path are missing:" \
            "install the Debian package python${version%.*}-venv."
    fi
    if [[ $lacks == *headers* ]]; then
        complain "Python.h of $path is missing: install the Debian package python${version%.*}-dev."
    fi
}

# compiles LANGUAGE HEADER COMPILER...: whether one of the compilers takes a program that includes the header.
compiles() {
    local language=$1 header=$2 compiler
    shift 2
    for compiler in "$@"; do
        # Unquoted, since CC and CXX may hold options.
        if $compiler -x "$language" -fsyntax-only - <<< "#include <$header>" &> /dev/null; then
            return
        fi
    done
    return 1
}

check_compilers() {
    compiles c stdio.h ${CC:+"$CC"} cc gcc clang ||
        complain 'A working C compiler is missing: install the Debian package gcc.'
    compiles c++ vector ${CXX:+"$CXX"} c++ g++ clang++ ||
        complain 'A working C++ compiler is missing: install the Debian package g++.'
}

check_platform() {
    [[ $(uname -sm) == 'Linux x86_64' ]] ||
        complain "ROS 2 has wheels for Linux on x86_64, not for $(uname -sm): use colcon in an installation of ROS 2."
}

# digest TEXT PATH...: of the text and of every file below the paths, names included.
digest() {
    local text=$1
    shift
    {
        echo "$text"
        find "$@" -type f ! -path '*/__pycache__/*' -print0 | LC_ALL=C sort -z | xargs -0 sha256sum
    } | sha256sum | cut -d ' ' -f 1
}

is_done() {
    [[ $(cat ".venv/stamps/$1" 2> /dev/null) == "$2" ]]
}

# begin NAME DIGEST COMMAND: starts the command of a step unless its stamp holds the digest.
begin() {
    local name=$1 digest=$2 command=$3
    if is_done "$name" "$digest"; then
        return
    fi
    rm -f ".venv/stamps/$name"
    began[$name]=$(date +%s%N)
    # Monitor mode gives the step a process group of its own, which a signal can end as a whole.
    set -m
    (set -e; "$command") > ".venv/log/$name.log" 2>&1 < /dev/null &
    jobs[$name]=$!
    set +m
}

# finish NAME DIGEST TITLE: waits for a step that was begun, and stamps it.
finish() {
    local name=$1 digest=$2 title=$3 status=0 took
    if [[ -z ${jobs[$name]:-} ]]; then
        return
    fi
    printf 'setup: %s ... ' "$title"
    wait "${jobs[$name]}" || status=$?
    unset "jobs[$name]"
    if ((status)); then
        printf 'failed\n'
        {
            tail -n 20 ".venv/log/$name.log"
            echo "setup: step $name failed with code $status, see $venv/log/$name.log"
        } >&2
        end_jobs
        exit 1
    fi
    echo "$digest" > ".venv/stamps/$name"
    took=$((($(date +%s%N) - began[$name]) / 100000000))
    printf '%d.%d s\n' $((took / 10)) $((took % 10))
}

# step NAME DIGEST TITLE COMMAND: a step that nothing else runs beside.
step() {
    begin "$1" "$2" "$4"
    finish "$1" "$2" "$3"
}

end_jobs() {
    local job
    for job in "${jobs[@]}"; do
        kill -INT -- "-$job" 2> /dev/null || true
        wait "$job" || true
    done
}

interrupt() {
    end_jobs
    printf '\nsetup: interrupted; the next run goes on from here\n' >&2
    exit "$1"
}

install_wheels() {
    "$python" -m venv .venv
    .venv/bin/python -m pip install --disable-pip-version-check --progress-bar off -r requirements.txt
}

build_messages() {
    local build=.venv/build/msg_defs installed=.venv/build/msg_defs.installed
    rm -rf "$build"
    .venv/bin/cmake -S msg_defs -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF \
        -DONLY_PYTHON=ON -DCMAKE_MAKE_PROGRAM="$venv/bin/ninja" -DPython3_EXECUTABLE="$venv/bin/python" \
        -DCMAKE_INSTALL_PREFIX="$venv" -DCMAKE_PREFIX_PATH="$venv"
    .venv/bin/cmake --build "$build"
    # A message that is gone from msg_defs must not linger.
    if [[ -f $installed ]]; then
        xargs -d '\n' rm -f < "$installed"
    fi
    .venv/bin/cmake --install "$build"
    cp "$build/install_manifest.txt" "$installed"
}

install_package() {
    # From a copy, for pip leaves build/ and an egg-info beside what it installs.
    local copy=.venv/build/package site content name
    rm -rf "$copy"
    mkdir -p "$copy"
    cp -R "${package[@]}" "$copy"
    .venv/bin/python -m pip install --disable-pip-version-check --no-index --no-deps --no-build-isolation \
        --force-reinstall "./$copy"
    rm -rf "$copy"

    # numba takes a compiled kernel for stale when its own file changes, and overlooks that another one did from which
    # it has taken in something: all of them go when any has changed, and none when something else did.
    site=$(echo .venv/lib/python3.*/site-packages/mobile_planning)
    content=$(find "$site" -name '*_kernels.py' -print0 | LC_ALL=C sort -z | xargs -0 cat | sha256sum)
    if [[ $content != $(cat .venv/kernels 2> /dev/null) ]]; then
        find "$site" -name '*.nb[ic]' -delete
    fi
    echo "$content" > .venv/kernels

    # pip puts executables into bin/; `ros2 run` looks here.
    rm -rf .venv/lib/mobile_planning
    mkdir -p .venv/lib/mobile_planning
    sed -n 's/ *= *mobile_planning\..*//p' "$site"-*.dist-info/entry_points.txt | while read -r name; do
        ln -s "../../bin/$name" ".venv/lib/mobile_planning/$name"
    done
}

compile_kernels() {
    # Isolated, so that the installed package is compiled and not the one in the current folder.
    .venv/bin/python -I -m mobile_planning.warm_up
    # The tests import the same files from here.
    find mobile_planning -name '*.nb[ic]' -delete
    cd .venv/lib/python3.*/site-packages
    find mobile_planning -name '*.nb[ic]' -exec cp --parents -t "$root" {} +
}

main() {
    local complaints=0 python='' wheels messages code
    # Two set-ups at once: the second waits, then finds everything done.
    exec 9< launch/setup.sh
    if ! flock -n 9 2> /dev/null && command -v flock > /dev/null; then
        echo 'setup: waiting for another set-up of this repository'
        flock 9
    fi
    declare -A jobs=() began=()
    trap 'interrupt 130' INT
    trap 'interrupt 143' TERM

    choose_python
    wheels=$(digest "$root $python" requirements.txt)
    messages=$(digest "$wheels" msg_defs)
    if ! is_done wheels "$wheels" || ! is_done messages "$messages"; then
        check_platform
        check_compilers
    fi
    if ((complaints)); then
        exit 1
    fi
    if ! is_done wheels "$wheels"; then
        # Stamps first: what is left when this is interrupted must not look done.
        rm -rf .venv/stamps
        rm -rf .venv
        mkdir -p .venv/stamps .venv/log
        echo "$python" > .venv/stamps/python
    fi
    step wheels "$wheels" "wheels for $python into .venv" install_wheels
    code=$(digest "$wheels" "${package[@]}")
    step package "$code" 'package' install_package
    begin messages "$messages" build_messages
    begin kernels "$code" compile_kernels
    finish messages "$messages" 'messages'
    finish kernels "$code" 'kernels'
}

main
