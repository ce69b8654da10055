#!/usr/bin/env bash
# Tests what `./dev check --changed` finds near a changed file. Run by `./dev lint`, which installs python3.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

# expect FILE LINE...: .ci/reach FILE prints these, among others.
expect() {
  local output line
  output=$(.ci/reach "$1")
  for line in "${@:2}"; do
    grep --quiet --line-regexp "$line" <<<"$output" || { printf 'reach_test: %s: no "%s" in:\n%s\n' "$1" "$line" "$output"; exit 1; }
  done
}

expect control/limits.h 'lint control/limits.cpp' 'test test_control LimitedWrench'
expect control/limits.cpp 'lint control/limits.cpp' 'test test_control LimitedWrench'
expect drivers/ethercat/frame.cpp 'lint drivers/ethercat/frame.cpp' 'test test_drivers Frame' 'left .* more test files .*'
expect tests/hal/clock_test.cpp 'test test_hal VirtualClock'
# Included by headers only: a source that includes them.
expect drivers/ethercat/link.h 'lint drivers/.*\.cpp' 'left .* more test files .*'
# Included by sources only: the tests of their headers.
expect control/positive.h 'lint control/.*\.cpp' 'test test_control ArmProtection'
# Not the test of another file of this name, which does not include it.
expect operation/report.h 'test test_operation TeleopSession'
! grep --quiet ' Report$' <<<"$(.ci/reach operation/report.h)" || { echo 'reach_test: report/report.h is another'; exit 1; }
# One name of two programs: both are built.
expect drivers/ethercat/mailbox_line.h 'test test_drivers Mailbox' 'test test_sim Mailbox'
expect README.md 'left README.md: .*'
expect no/such_file.cpp 'left no/such_file.cpp: it is gone'
! grep --quiet '^lint' <<<"$(.ci/reach tests/hal/clock_test.cpp)" || { echo 'reach_test: tests are not linted'; exit 1; }
echo 'reach_test: passed'
