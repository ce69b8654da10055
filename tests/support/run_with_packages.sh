#!/usr/bin/env bash
# Runs a JavaScript test with the npm packages of its folder. Exit code 77: they cannot be fetched, and why.
# usage: run_with_packages.sh TEST.mjs SCRATCH ARGUMENTS...   gives the test SCRATCH as its last argument
set -euo pipefail

test=$1
scratch=$2
shift 2
command -v node >/dev/null || { echo 'node is missing: ./dev test installs it'; exit 1; }
packages=$("$(dirname "${BASH_SOURCE[0]}")/fetch_packages.sh" "$(dirname "$test")" 2>&1) || { echo "skipped: $packages"; exit 77; }
rm -rf "$scratch"
mkdir -p "$scratch"
# Modules are searched from the script upwards.
cp "$test" "$scratch"
ln -s "$packages/node_modules" "$scratch/node_modules"
exec nice node "$scratch/$(basename "$test")" "$@" "$scratch"
