#!/usr/bin/env bash
# The guest's files as an initramfs: a shell, udev with Debian's rules and ours, the kernel's modules, a test
# program and the libraries of all of them. Takes about a second; root is not needed.
# usage: make_image.sh KERNEL_FOLDER TEST_PROGRAM RULES_FOLDER IMAGE [TEST_OPTION...]
set -euo pipefail
PATH+=:/usr/sbin:/sbin

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
kernel=$(realpath "$1") program=$(realpath "$2") rules=$(realpath "$3") image=$(realpath "$4")
shift 4

root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
chmod 755 "$root"  # the guest's /, for users too
cd "$root"
mkdir -p dev etc/udev/rules.d proc run sys tmp usr/{bin,lib/udev/rules.d,lib/systemd,lib64}
ln -s usr/bin bin
ln -s usr/bin sbin
ln -s usr/lib lib
ln -s usr/lib64 lib64

# add FILE PLACE: with the libraries it needs, where it looks for them.
add() {
  local library
  cp --dereference "$1" "$2"
  # A statically linked program has none, which makes ldd and grep fail.
  for library in $(ldd "$1" 2>/dev/null | grep --only-matching '/[^ ]*' || true); do
    mkdir -p ".$(dirname "$library")"
    cp --dereference --no-clobber "$library" ".$library"
  done
}

add "$(command -v busybox)" bin/busybox
for applet in sh cat echo ip mkdir modprobe mount poweroff xargs; do ln -s busybox bin/$applet; done
add "$(command -v udevadm)" bin/udevadm
ln -s /bin/udevadm lib/systemd/systemd-udevd
cp /lib/udev/rules.d/50-udev-default.rules lib/udev/rules.d/
cp "$rules"/*.rules etc/udev/rules.d/
# As in a fresh Debian; plugdev is among the groups.
cp /usr/share/base-passwd/passwd.master etc/passwd
cp /usr/share/base-passwd/group.master etc/group
printf 'passwd: files\ngroup: files\n' > etc/nsswitch.conf

cp -r "$kernel/lib/modules" lib/
cp "$kernel/modules" etc/modules
add "$program" guest_tests
strip --strip-debug guest_tests
printf '%s\0' --gtest_color=no "$@" > etc/test_options
cp "$here/guest_init.sh" init
chmod +x init

# Owned by root. Not compressed: unpacking in the guest would take longer than reading.
find . -print0 | cpio --null --create --format=newc --owner=0:0 --quiet > "$image"
