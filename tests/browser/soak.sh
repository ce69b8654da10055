#!/bin/sh
# soak.mjs in a network namespace of its own: soak.sh YOUBOTD YOUBOT_SIM FOLDER MINUTES
set -eu
command -v node >/dev/null || { echo 'soak needs nodejs and chromium: ./dev test installs them'; exit 1; }
unshare --net true || { echo 'soak needs root and network namespaces'; exit 1; }
exec unshare --net node "$(dirname "$0")/soak.mjs" "$@"
