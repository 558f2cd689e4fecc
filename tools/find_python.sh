#!/bin/sh
# Print the Python to set up with: the one named as $1, else that of a finished set-up, else the first that
# has all that set-up needs, else the first of a right version (what it lacks is named later).
# One sentence and exit code 2 if there is none.
version_fits='import sys; assert (3, 10) <= sys.version_info[:2] <= (3, 13)'
complete="$version_fits; import ensurepip, venv, os, sysconfig
assert os.path.exists(sysconfig.get_paths()['include'] + '/Python.h')"
tell='print(sys.executable)'

try() { command -v "$1" >/dev/null 2>&1 && "$1" -E -S -c "$2; $tell" 2>/dev/null; }

if [ -n "$1" ]; then
    try "$1" "$version_fits" && exit 0
    echo "error: PYTHON=$1 is no Python 3.10 to 3.13; name one that is, or leave PYTHON out" >&2
    exit 2
fi
[ -r .venv/stamp ] && [ -x .venv/bin/python ] && echo .venv/bin/python && exit 0
for wanted in "$complete" "$version_fits"; do
    for candidate in python3 python3.13 python3.12 python3.11 python3.10 python; do
        try "$candidate" "$wanted" && exit 0
    done
done
found=$(python3 -V 2>&1) || found='no Python'
echo "error: Python 3.10 to 3.13 is needed and $found was found: sudo apt install python3 python3-venv python3-dev" >&2
exit 2
