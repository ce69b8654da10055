#!/bin/sh
# The guest's first process: sets up the system, runs the tests, and prints their result. When it ends, the kernel
# panics and the machine switches off.
set -eu
export PATH=/bin HOME=/
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs devtmpfs /dev
mkdir -p /dev/shm
mount -t tmpfs tmpfs /dev/shm
mount -t tmpfs tmpfs /run

ip link set lo up
xargs modprobe -a </etc/modules
ip link add vcan0 type vcan
ip link set vcan0 up
/lib/systemd/systemd-udevd --daemon

code=0
xargs -0 /guest_tests </etc/test_options || code=$?
echo "guest: the tests ended with code $code"
poweroff -f
