#!/usr/bin/env bash
# Runs a test program in a guest with a kernel of its own (QEMU without KVM), where USB, HID and CAN devices can
# be made of nothing. Shows the guest's console. Passes only when the program says that it ran tests, that all
# passed, and the guest that it ended with 0: one that dies, hangs or stays silent fails.
# usage: run_guest.sh TEST_PROGRAM RULES_FOLDER [TEST_OPTION...]
# Exit codes: 0 passed, 1 failed, 77 skipped because something is missing; with YOUBOT_GUEST_MUST_RUN that fails
# too, because `./dev test` has installed and fetched it all.
set -euo pipefail
PATH+=:/usr/sbin:/sbin

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
longest_s=200  # half a minute is usual; the machine may be busy

skip() {
  echo "skipped: $1"
  [[ -z ${YOUBOT_GUEST_MUST_RUN:-} ]] || exit 1
  exit 77
}
fail() {
  echo "failed: $1"
  exit 1
}

[[ $(uname -m) == x86_64 ]] || { echo 'skipped: the guest is an x86-64 machine, and this is another one'; exit 77; }
for tool in qemu-system-x86_64 busybox udevadm modprobe cpio strip; do
  command -v "$tool" >/dev/null || skip "$tool is missing: ./dev test installs it"
done
kernel=$("$here/fetch_kernel.sh" --cached) || skip 'no PREEMPT_RT kernel in the cache: ./dev test fetches it'

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$here/make_image.sh" "$kernel" "$1" "$2" "$scratch/image" "${@:3}" || fail 'no image of the guest'

code=0
timeout --kill-after=10 "$longest_s" qemu-system-x86_64 \
  -machine q35 -accel tcg -cpu max -smp 2 -m 512 -nodefaults -no-user-config -no-reboot -display none -serial stdio \
  -kernel "$kernel/vmlinuz" -initrd "$scratch/image" \
  -append 'console=ttyS0 loglevel=3 panic=-1 mitigations=off tsc=reliable no_timer_check nokaslr' \
  </dev/null | tee "$scratch/console" || code=$?

console=$(tr -d '\r' <"$scratch/console")
says() { grep --quiet --extended-regexp "$1" <<<"$console"; }
((code != 124)) || fail "the guest did not end within $longest_s s"
((code == 0)) || fail "the virtual machine ended with code $code"
says '^guest: the tests ended with code 0$' || fail 'the guest did not say that its tests ended with code 0'
says '^\[  PASSED  \] [1-9][0-9]* tests?\.$' || fail 'the guest ran no tests'
! says '^\[  (FAILED|SKIPPED) ' || fail 'the guest failed or skipped a test'
