# To be sourced by bash: a virtual machine (QEMU without KVM) with Debian's PREEMPT_RT kernel. Gives
#   kernel, scratch    the folder of fetch_kernel.sh, and one that is gone when the script ends
#   need, boot, says   below
# A script that sources it exits with 0 passed, 1 failed, 77 skipped because something is missing; with
# YOUBOT_GUEST_MUST_RUN that fails too, because `./dev test` has installed and fetched it all.
PATH+=:/usr/sbin:/sbin
longest_s=1500  # a minute is usual; the machine may be busy

skip() {
  echo "skipped: $1"
  [[ -z ${YOUBOT_GUEST_MUST_RUN:-} ]] || exit 1
  exit 77
}
fail() {
  echo "failed: $1"
  exit 1
}

# need TOOL...: programs of this machine.
need() {
  local tool
  for tool in "$@"; do
    command -v "$tool" >/dev/null || skip "$tool is missing: ./dev test installs it"
  done
}

# boot IMAGE [QEMU_OPTION...]: runs the guest until it is off and shows its console. The console must report that the
# tests ended with code 0: a guest that crashes, hangs or prints nothing fails.
boot() {
  local image=$1 code=0
  shift
  timeout --kill-after=10 "$longest_s" qemu-system-x86_64 \
    -machine q35 -accel tcg -cpu max -smp 2 -m 512 -nodefaults -no-user-config -no-reboot -display none \
    -serial stdio -kernel "$kernel/vmlinuz" -initrd "$image" "$@" \
    -append 'console=ttyS0 loglevel=3 panic=-1 mitigations=off tsc=reliable no_timer_check nokaslr' \
    </dev/null | tee "$scratch/console" || code=$?
  console=$(tr -d '\r' <"$scratch/console")
  ((code != 124)) || fail "the guest did not end within $longest_s s"
  ((code == 0)) || fail "the virtual machine ended with code $code"
  says '^guest: the tests ended with code 0$' || fail 'the guest did not say that its tests ended with code 0'
}

# says REGEX: whether a line of the guest's console matches.
says() { grep --quiet --extended-regexp "$1" <<<"$console"; }

[[ $(uname -m) == x86_64 ]] || { echo 'skipped: the guest is an x86-64 machine, and this is another one'; exit 77; }
need qemu-system-x86_64 busybox modprobe cpio
kernel=$("$(dirname "${BASH_SOURCE[0]}")/fetch_kernel.sh" --cached) ||
  skip 'no PREEMPT_RT kernel in the cache: ./dev test fetches it'
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
