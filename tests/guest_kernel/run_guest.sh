#!/usr/bin/env bash
# Runs a test program in a guest with its own kernel, where USB, HID and CAN devices can be emulated.
# Passes only when the program reports that it ran tests and that all passed. Exit codes: virtual_machine.sh.
# usage: run_guest.sh TEST_PROGRAM RULES_FOLDER [TEST_OPTION...]
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source "$here/virtual_machine.sh"
need udevadm strip
"$here/make_image.sh" "$kernel" "$1" "$2" "$scratch/image" "${@:3}" || fail 'no image of the guest'
boot "$scratch/image"
says '^\[  PASSED  \] [1-9][0-9]* tests?\.$' || fail 'the guest ran no tests'
! says '^\[  (FAILED|SKIPPED) ' || fail 'the guest failed or skipped a test'
