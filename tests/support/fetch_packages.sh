#!/usr/bin/env bash
# The npm packages that a test needs, in a cache of their own. Prints the folder that has their node_modules.
# npm fetches them from the registry that it is configured with (some 25 MB) and runs none of their scripts.
# usage: fetch_packages.sh FOLDER   fetches those of FOLDER/package.json if they are not in the cache
set -euo pipefail

wanted=$1/package.json
cache=${XDG_CACHE_HOME:-$HOME/.cache}/youbot-hal
folder=$cache/npm-$(cksum <"$wanted" | cut -d ' ' -f 1)
if [[ -d $folder ]]; then
  printf '%s\n' "$folder"
  exit
fi

command -v npm >/dev/null || { echo 'fetch_packages.sh: npm is missing' >&2; exit 1; }
mkdir -p "$cache"
new=$(mktemp -d "$cache/new-XXXXXX")
trap 'rm -rf "$new"' EXIT
cp "$wanted" "$new/package.json"
(cd "$new" && npm install --ignore-scripts --no-package-lock --no-audit --no-fund --fetch-retries=1 >npm.log 2>&1) || {
  echo "fetch_packages.sh: npm could not fetch the packages of $wanted:" >&2
  grep -i -m 2 "^npm err" "$new/npm.log" >&2 || true
  exit 1
}
# A concurrent run may have created the folder: both are equal.
mv --no-target-directory "$new" "$folder" 2>/dev/null || [[ -d $folder ]]
printf '%s\n' "$folder"
