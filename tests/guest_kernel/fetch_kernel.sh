#!/usr/bin/env bash
# Debian's PREEMPT_RT kernel, for the guest to run. Prints the folder in the cache that holds
#   vmlinuz       the kernel
#   modules       the names of the modules that the guest of the device tests loads, one per line
#   lib/modules/  these modules and their dependencies
# Downloads the current kernel through apt when it is not in the cache; installs nothing and needs no root.
# usage: fetch_kernel.sh           the current one according to apt, or the newest in the cache when apt has none
#        fetch_kernel.sh --cached  the newest in the cache; no network, exit code 1 when there is none
set -euo pipefail
PATH+=:/usr/sbin:/sbin

modules=(
  vcan can-raw  # a CAN bus between programs
  vhci-hcd      # a USB host without hardware: devices are programs
  usbhid        # HID devices on it
  uhid          # HID devices without USB
  hid-generic   # the driver that makes both readable
  hid-logitech  # the driver of the older SpaceMouse devices
)
host_modules=(
  virtio-pci 9pnet-virtio 9p overlay  # a guest that has the host's programs
  veth  # an Ethernet cable between programs
)
cache=${XDG_CACHE_HOME:-$HOME/.cache}/youbot-hal
# A kernel with other modules is a separate cache entry.
key=modules-$(printf '%s ' "${modules[@]}" "${host_modules[@]}" | cksum | cut -d ' ' -f 1)

newest_cached() {
  local found
  found=$(printf '%s\n' "$cache"/linux-image-*_"$key" | sort --version-sort | tail -n 1)
  [[ -d $found ]] && printf '%s\n' "$found"
}

if [[ ${1:-} == --cached ]]; then
  newest_cached
  exit
fi

package=$({ apt-cache depends linux-image-rt-amd64 2>/dev/null || true; } |
  sed -n 's/^ *Depends: \(linux-image-[^ ]*\)$/\1/p' | head -n 1)
version=$([[ -z $package ]] || apt-cache show --no-all-versions "$package" | sed -n 's/^Version: //p' | head -n 1)
folder=$cache/${package}_${version}_$key
if [[ -d $folder && -n $version ]]; then
  printf '%s\n' "$folder"
  exit
fi

mkdir -p "$cache"
new=$(mktemp -d "$cache/new-XXXXXX")
trap 'rm -rf "$new"' EXIT

download() {
  [[ -n $version ]] || { echo 'fetch_kernel.sh: apt knows no linux-image-rt-amd64: apt-get update' >&2; return 1; }
  # apt's own user may have no access to the cache.
  (cd "$new" && apt-get -qq -o APT::Sandbox::User=root download "$package=$version")
}
if ! download; then
  newest_cached && exit
  echo "fetch_kernel.sh: no PREEMPT_RT kernel in the cache, and none could be downloaded" >&2
  exit 1
fi

mkdir "$new/all" "$new/folder"
dpkg-deb --fsys-tarfile "$new"/*.deb | tar -x -C "$new/all" ./boot ./lib
release=$(ls "$new/all/lib/modules")
mv "$new/all/boot/vmlinuz-$release" "$new/folder/vmlinuz"
depmod --basedir "$new/all" "$release"  # missing in the package
printf '%s\n' "${modules[@]}" > "$new/folder/modules"
(
  cd "$new/all"
  for module in "${modules[@]}" "${host_modules[@]}"; do
    modprobe --dirname "$new/all" --set-version "$release" --show-depends "$module"
  done | sed -n "s|^insmod $new/all/\([^ ]*\).*|\1|p" | sort -u | xargs cp --parents --target-directory "$new/folder"
  cp --parents --target-directory "$new/folder" lib/modules/"$release"/modules.{order,builtin,builtin.modinfo}
)
depmod --basedir "$new/folder" "$release"
# A concurrent run may have created the folder: both are equal.
mv --no-target-directory "$new/folder" "$folder" 2>/dev/null || [[ -d $folder ]]
printf '%s\n' "$folder"
