#!/usr/bin/env bash
# .ci/tidy caches passes only: a finding in a header is reported for every including file, each time, until it is
# fixed. Run by `./dev lint`, which installs clang-tidy.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export XDG_CACHE_HOME=$scratch/cache

# project FOLDER: a.cpp and b.cpp include shared.h, c.cpp does not.
project() {
  mkdir -p "$1/build"
  cp "$root/.clang-tidy" "$1/"
  printf '#pragma once\ninline int good_name() { return 1; }\n' >"$1/shared.h"
  printf '#include "shared.h"\nint a() { return good_name(); }\n' >"$1/a.cpp"
  printf '#include "shared.h"\nint b() { return good_name(); }\n' >"$1/b.cpp"
  printf 'int c() { return 3; }\n' >"$1/c.cpp"
  local file separator='['
  for file in a b c; do
    printf '%s{"directory": "%s", "command": "ccache /usr/bin/c++ -I%s -std=c++20 -o %s.o -c %s", "file": "%s"}\n' \
      "$separator" "$1/build" "$1" "$file" "$1/$file.cpp" "$1/$file.cpp"
    separator=','
  done >"$1/build/compile_commands.json"
  echo ']' >>"$1/build/compile_commands.json"
}

alone=(--alone)
# expect WHAT FOLDER KNOWN FINDINGS [FILE...]: FILE: has findings.
expect() {
  local output status=0 file
  output=$(cd "$2" && TIDY_ROOT=$2 "$root/.ci/tidy" "${alone[@]}" build a.cpp b.cpp c.cpp 2>&1) || status=$?
  for file in "tidy: 3 files, $3 known to pass, $4 with findings" "${@:5}"; do
    grep --quiet --fixed-strings "$file" <<<"$output" || { printf 'tidy_test: %s: no "%s" in:\n%s\n' "$1" "$file" "$output"; exit 1; }
  done
  ((status == ($4 > 0))) || { echo "tidy_test: $1: exit status $status"; exit 1; }
}

one=$scratch/one
project "$one"
expect 'at first' "$one" 0 0
expect 'again' "$one" 3 0

bad='inline int BadName() { return 2; }'
echo "$bad" >>"$one/shared.h"
expect 'a finding in the header' "$one" 1 2 'tidy: a.cpp,' 'tidy: b.cpp,' \
  "invalid case style for function 'BadName'"
expect 'the same finding again' "$one" 1 2 'tidy: a.cpp,' 'tidy: b.cpp,'

sed -i "s|^inline int BadName.*|$bad  // NOLINT(readability-identifier-naming)|" "$one/shared.h"
expect 'the finding is allowed by a comment' "$one" 1 0
sed -i 's|  // NOLINT.*||' "$one/shared.h"
expect 'only the comment is gone' "$one" 1 2 'tidy: a.cpp,' 'tidy: b.cpp,'
sed -i '/BadName/d' "$one/shared.h"
expect 'mended' "$one" 3 0

project "$scratch/two"
expect 'another clone' "$scratch/two" 3 0
sed -i 's|-std=c++20|-std=c++20 -DOTHER|' "$scratch/two/build/compile_commands.json"
expect 'other options' "$scratch/two" 0 0
sed -i 's/^  modernize-use-override,$//' "$one/.clang-tidy"
expect 'another configuration' "$one" 0 0

# A file that is compiled twice counts with the options of both.
project "$scratch/three"
XDG_CACHE_HOME=$scratch/cache3
commands=$scratch/three/build/compile_commands.json
sed -n 's/^\[\(.*\)/,\1/p' "$commands" >"$scratch/again"
sed -i '$d' "$commands"
cat "$scratch/again" >>"$commands"
echo ']' >>"$commands"
expect 'compiled twice' "$scratch/three" 0 0
sed -i '1s|-std=c++20|-std=c++20 -DOTHER|' "$commands"
expect 'the first of both with other options' "$scratch/three" 2 0

# In a unity source: the finding is printed once but counts for all files; an include of a neighbour only is reported.
project "$scratch/four"
XDG_CACHE_HOME=$scratch/cache4
together=$scratch/four/build/Unity/unity_0_cxx.cxx
mkdir "${together%/*}"
printf '#include "%s"\n' "$scratch/four/"{a,b}.cpp >"$together"
commands=$scratch/four/build/compile_commands.json
sed -i "/b.cpp/d; s|$scratch/four/a.cpp|$together|g" "$commands"
expect 'compiled together' "$scratch/four" 0 0
expect 'compiled together, again' "$scratch/four" 3 0
echo "$bad" >>"$scratch/four/shared.h"
expect 'a finding in the header' "$scratch/four" 1 2 'tidy: a.cpp,' 'tidy: b.cpp,' "function 'BadName'"
sed -i '/BadName/d' "$scratch/four/shared.h"
sed -i '/include/d' "$scratch/four/b.cpp"
expect 'a missing include' "$scratch/four" 1 1 'tidy: b.cpp,' "undeclared identifier 'good_name'"
alone=()
expect 'a missing include, not compiled alone' "$scratch/four" 3 0
echo 'tidy_test: passed'
