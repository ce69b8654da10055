#!/bin/sh
# The guest's first process: mounts the host's /usr through QEMU and the installation over it, and starts systemd. When
# it ends earlier, the kernel panics and the machine switches off.
set -eu
export PATH=/bin
mount -t proc proc /proc
modprobe -a virtio_pci 9pnet_virtio 9p overlay

mount -t tmpfs -o mode=755 tmpfs /new
cp -a /root/. /new
mkdir /new/.installed /new/.machine
cp -a /usr/. /new/.installed
mount -t 9p -o trans=virtio,version=9p2000.L,ro,cache=loose,msize=262144 usr /new/.machine
mount -t overlay -o ro,lowerdir=/new/.installed:/new/.machine usr /new/usr

exec switch_root /new /lib/systemd/systemd --unit=boot-test.service
