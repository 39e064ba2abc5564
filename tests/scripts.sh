#!/usr/bin/env bash
# Runs scripts with an expected output: tests/scripts.sh [scripts/exam/problem1.lua ...]; all of them by default.
# Standard output must equal the .out beside the script and the exit status must be 0. SNAP_UPDATE=1 rewrites the .out.
# The working directory is a fresh one that holds nothing but a link to scripts/, so that figures a script saves
# do not litter the repository while messages still name the script by its path in it.
set -u
root=$(cd "$(dirname "$0")/.." && pwd)
pendula=${PENDULA:-$root/build/release/pendula}
[ -x "$pendula" ] || { echo "scripts.sh: no program at $pendula (./dev build)" >&2; exit 2; }
export NO_COLOR=1 LC_ALL=C.UTF-8 COLUMNS=100 TERM=dumb

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export HOME=$work
ln -s "$root/scripts" "$work/scripts"
cd "$work" || exit 2

failed=0
check() {
  local script=$1 expected=$root/${1%.lua}.out status=0
  "$pendula" "$script" >"$work/stdout" 2>"$work/stderr" </dev/null || status=$?
  if [ $status -ne 0 ]; then
    echo "$script: exit status $status"; tail -n 20 "$work/stdout" "$work/stderr"; failed=1
  elif [ -n "${SNAP_UPDATE:-}" ]; then
    cmp -s "$work/stdout" "$expected" || { cp "$work/stdout" "$expected"; echo "$script: rewrote ${1%.lua}.out"; }
  elif ! diff -u --label "expected (${1%.lua}.out)" --label "printed" "$expected" "$work/stdout"; then
    echo "$script: the output differs; SNAP_UPDATE=1 tests/scripts.sh $script accepts it"; failed=1
  fi
}

if [ $# -eq 0 ]; then
  mapfile -t outs < <(cd "$root" && find scripts -name '*.out' | LC_ALL=C sort)
  set -- "${outs[@]/%.out/.lua}"
fi
for script in "$@"; do check "$script"; done
exit $failed
