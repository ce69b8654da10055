#!/bin/sh
# soak.mjs in a network namespace of its own: soak.sh YOUBOTD YOUBOT_SIM FOLDER MINUTES
set -eu
command -v node >/dev/null || { echo 'soak needs nodejs and chromium: ./dev test installs them'; exit 1; }
if ! unshare --net true; then
  echo 'soak needs root and network namespaces'
  [ -n "${YOUBOT_TESTS_MUST_RUN:-}" ] && [ "$(id -u)" -eq 0 ] && exit 1
  exit 77  # skipped
fi
exec unshare --net node "$(dirname "$0")/soak.mjs" "$@"
