#!/usr/bin/env bash
# Boots systemd in a guest with the installed youbotd and tests the service there, with boot_test.sh. The guest has
# this machine's /usr, which it cannot change, under an /etc of its own. Exit codes: virtual_machine.sh.
# usage: run_booted.sh BUILD_FOLDER; everything is built. Root is not needed.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source "$here/../guest_kernel/virtual_machine.sh"
need /usr/lib/systemd/systemd systemd-sysusers ip setpriv cmake strip
[[ -e /usr/lib/systemd/system/systemd-udevd.service ]] || skip 'udev is missing: ./dev test installs it'

files=$scratch/files
mkdir -p "$files"/{bin,dev,proc,sys,new} "$files"/usr/lib
# For the guest's first process, until it has this machine's programs.
cp "$(command -v busybox)" "$files/bin/busybox"
for applet in sh cp mkdir modprobe mount switch_root; do ln -s busybox "$files/bin/$applet"; done
cp "$here/booted_init.sh" "$files/init"
chmod +x "$files/init"
ln -s usr/lib "$files/lib"

# Over this machine's /usr.
cp -r "$kernel/lib/modules" "$files/usr/lib/"
DESTDIR=$files cmake --install "$1" --prefix /usr/local >"$scratch/installed" ||
  fail "cmake --install: $(cat "$scratch/installed")"

# The rest of the guest's /. Users as in a fresh Debian, root's home and two more, whom systemd-sysusers makes.
root=$files/root
mkdir -p "$root"/{dev,proc,sys,run,usr,var} "$root"/home/member "$root"/etc/{sysusers.d,systemd/system}
for folder in bin sbin lib lib64; do ln -s usr/$folder "$root/$folder"; done
cp /usr/share/base-passwd/passwd.master "$root/etc/passwd"
cp /usr/share/base-passwd/group.master "$root/etc/group"
printf 'passwd: files\ngroup: files\n' >"$root/etc/nsswitch.conf"
# Some names below /usr, such as liblapack.so.3, link to /etc.
cp -a /etc/alternatives "$root/etc/"
# Without a machine id systemd assumes the first boot of a new machine and enables all units.
printf '%032d\n' 1 >"$root/etc/machine-id"
printf 'u member -\nu visitor -\nm member youbot\n' >"$root/etc/sysusers.d/people.conf"
printf '[Manager]\nShowStatus=no\n' >"$root/etc/systemd/system.conf"
echo 'nothing of the service' >"$root/home/member/letter"
# Removes what other packages add to each boot.
mkdir "$root/etc/systemd/system-generators"
for generator in /usr/lib/systemd/system-generators/*; do
  ln -s /dev/null "$root/etc/systemd/system-generators/${generator##*/}"
done
cp "$here/boot_test.sh" "$here/boot-test.service" "$root/etc/systemd/system/"

(cd "$files" && find . -print0 | cpio --null --create --format=newc --owner=0:0 --quiet) >"$scratch/image"
boot "$scratch/image" -virtfs local,path=/usr,mount_tag=usr,security_model=none,readonly=on,multidevs=remap
