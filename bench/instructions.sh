#!/usr/bin/env bash
# Instructions of fixed pieces of work (bench/instructions.cpp), counted by callgrind and compared with the table
# bench/instructions.txt: the same on every run to 0.05 %, so that a change of 3 % is a change of the program.
#     bench/instructions.sh [--update] [case ...]
# A new count replaces the table's with --update. Counted is the work itself: kernels and machine code are warm.
# The counts belong to a release build and the processor that valgrind shows (AVX2, no AVX-512). Addresses and
# environment are fixed, since hash tables and alignment depend on them.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
table=$here/instructions.txt
program=${INSTRUCTIONS_PROGRAM:-$here/../build/release/bench/bench_instructions}
allowed=1.03
update=no
if [[ ${1:-} == --update ]]; then update=yes; shift; fi
command -v valgrind >/dev/null || { echo "instructions: valgrind is not installed (apt-get install valgrind); skipped"; exit 0; }
[[ -x $program ]] || { echo "instructions: no program $program; cmake --build build/release --target bench_instructions makes it" >&2; exit 1; }

count() {
  (cd / && exec setarch -R env -i LC_ALL=C.UTF-8 PATH=/usr/bin:/bin valgrind --tool=callgrind --callgrind-out-file=/dev/null \
    --toggle-collect='counted_section*' "$program" "$here" "$1") 2>&1 >/dev/null | sed -n 's/.*Collected : *\([0-9]*\).*/\1/p'
}
before() { awk -v name="$1" '$1 == name { print $2 }' "$table" 2>/dev/null; }

if (($# == 0)); then mapfile -t cases < <("$program" "$here"); else cases=("$@"); fi
status=0
printf '%-18s %14s %14s %8s\n' case table now ratio
for name in "${cases[@]}"; do
  old=$(before "$name") now=$(count "$name")
  if [[ -z $now || $now == 0 ]]; then echo "instructions: $name does not run" >&2; status=1; continue; fi
  printf '%-18s %14s %14s %8s\n' "$name" "${old:--}" "$now" "$(awk -v a="${old:-0}" -v b="$now" 'BEGIN { if (a > 0) printf "%.3f", b/a; else printf "new" }')"
  if [[ $update == yes ]]; then
    { grep -v "^$name " "$table" 2>/dev/null || true; printf '%-18s %14s\n' "$name" "$now"; } >"$table.new"
    { grep '^#' "$table.new"; grep -v '^#' "$table.new" | sort; } >"$table"
    rm -f "$table.new"
  elif [[ -z $old ]]; then
    echo "instructions: $name is not in the table yet: bench/instructions.sh --update $name" >&2; status=1
  else
    awk -v a="$old" -v b="$now" -v c="$allowed" 'BEGIN { exit !(b <= c*a) }' || { echo "instructions: $name takes more than 3 % above the table" >&2; status=1; }
  fi
done
[[ $update == yes ]] && exit 0
exit $status
