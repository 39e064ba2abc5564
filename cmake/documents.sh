#!/bin/sh
# documents.sh <program> <source tree> <folder> <version>: what a package has beside the program, as Debian wants it.
set -eu
program=$1 root=$2 folder=$3 version=$4
gzip -9nc "$root/docs/pendula.1" >"$folder/pendula.1.gz"
gzip -9nc "$root/CHANGELOG.md" >"$folder/NEWS.gz"
date=$(LC_ALL=C date -u -R -d "@$(git -C "$root" log -1 --format=%ct 2>/dev/null || echo 0)")
{
  printf 'pendula (%s) stable; urgency=low\n\n' "$version"
  printf '  * What changed is in NEWS.gz beside this file.\n'
  printf '\n -- The Pendula maintainers <maintainers@pendula.invalid>  %s\n' "$date"
} | gzip -9nc >"$folder/changelog.gz"
{
  printf 'Pendula %s\n\nCopyright © 2026 the authors of Pendula. No licence has been chosen yet.\n\n' "$version"
  "$program" --licences
  printf '\nThe GNU licences are in /usr/share/common-licenses (GPL-2, GPL-3, LGPL-2.1, LGPL-3).\n'
} >"$folder/copyright"
