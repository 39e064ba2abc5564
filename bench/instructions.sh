#!/usr/bin/env bash
# Instructions spent inside the steps of a few fixed runs, counted by callgrind: the same on every run, so that a
# change of 2 % is a change of the program.     bench/instructions.sh [--update] [pendula]
# The counts belong to a release build and a processor with AVX2.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
baseline=$here/instructions.txt
update=no
if [[ ${1:-} == --update ]]; then update=yes; shift; fi
program=${1:-$here/../build/release/pendula}
command -v valgrind >/dev/null || { echo "instructions: valgrind is not installed (apt-get install valgrind); skipped"; exit 0; }
[[ -x $program ]] || { echo "instructions: no program $program; ./dev build makes it" >&2; exit 1; }

count() {
  valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect='pendula::integrate::*Stepper::step(double)' \
    "$program" "$here/instructions.lua" "$1" 2>&1 >/dev/null | sed -n 's/.*Collected : *\([0-9]*\).*/\1/p'
}

status=0
result=$(mktemp)
trap 'rm -f "$result"' EXIT
printf '%-10s %14s %14s %8s\n' run baseline now change
while read -r name before; do
  [[ $name == \#* ]] && { echo "$name $before" >>"$result"; continue; }
  now=$(count "$name")
  echo "$name ${now:-0}" >>"$result"
  printf '%-10s %14s %14s %7s%%\n' "$name" "$before" "${now:-none}" "$(awk -v a="$before" -v b="${now:-0}" 'BEGIN { printf "%+.2f", a > 0 ? 100*(b - a)/a : 0 }')"
  awk -v a="$before" -v b="${now:-0}" 'BEGIN { exit !(b > 0 && (a == 0 || b <= 1.02*a)) }' || status=1
done <"$baseline"
if [[ $update == yes ]]; then cp "$result" "$baseline"; exit 0; fi
((status == 0)) || echo "instructions: more than 2 % above the baseline; if that is meant: bench/instructions.sh --update" >&2
exit $status
