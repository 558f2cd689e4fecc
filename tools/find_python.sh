#!/bin/sh
# Print the Python to set up with: the one named as $1, else that of a finished set-up, else the first that
# has all that set-up needs, else the first of a right version (what it lacks is named later).
# One sentence and exit code 2 if there is none; it names everything that can be known to be missing.
version_fits='import sys; assert (3, 10) <= sys.version_info[:2] <= (3, 13)'
complete="$version_fits; import ensurepip, venv, os, sysconfig
assert os.path.exists(sysconfig.get_paths()['include'] + '/Python.h')"
with_venv="$version_fits; import ensurepip, venv"
tell='print(sys.executable)'
sudo=$([ "$(id -u 2>/dev/null)" = 0 ] || echo 'sudo ')

try() { command -v "$1" >/dev/null 2>&1 && "$1" -E -S -c "$2; $tell" 2>/dev/null; }
missing() { ! command -v "${1%% *}" >/dev/null 2>&1; }

if [ -n "$1" ]; then
    try "$1" "$version_fits" && exit 0
    echo "error: PYTHON=$1 is no Python 3.10 to 3.13; name one that is, or leave PYTHON out" >&2
    exit 2
fi
[ -r .venv/stamp ] && try .venv/bin/python "$version_fits" && exit 0
for wanted in "$complete" "$with_venv" "$version_fits"; do
    for candidate in python3 python3.13 python3.12 python3.11 python3.10 python; do
        try "$candidate" "$wanted" && exit 0
    done
done
needed='Python 3.10 to 3.13'
packages='python3 python3-venv'
if missing "${CC:-cc}" || missing "${CXX:-c++}"; then
    needed="$needed and a C and C++ compiler"
    packages="$packages build-essential"
fi
if found=$(python3 -V 2>&1); then
    found="python3 is $found here"
    other='; where that brings no other version, install one beside it and name it: make PYTHON=python3.12'
else
    found='there is no Python here'
    other=
fi
echo "error: set-up needs $needed, and $found: ${sudo}apt install $packages$other" >&2
exit 2
