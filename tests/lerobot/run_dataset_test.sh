#!/usr/bin/env bash
# Runs dataset_test.mjs with the readers of fetch_readers.sh. Exit code 77: there are none, and why.
# usage: run_dataset_test.sh PROGRAMS SOURCES SCRATCH
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
command -v node >/dev/null || { echo 'node is missing: ./dev test installs it'; exit 1; }
readers=$("$here/fetch_readers.sh" 2>&1) || { echo "skipped: $readers"; exit 77; }
rm -rf "$3"
mkdir -p "$3"
# Modules are searched from the script upwards.
cp "$here/dataset_test.mjs" "$3"
ln -s "$readers/node_modules" "$3/node_modules"
exec nice node "$3/dataset_test.mjs" "$@"
