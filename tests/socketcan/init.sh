#!/bin/sh
# The first program of the user-mode Linux kernel: make CAN, run one command, switch off.
#
# The machine's own files are the root (hostfs), /dev is the kernel's own. The kernel hands over
# BOX, the folder in which `command` waits and in which `output` and `status` are left, and LIMIT,
# the seconds that the command may take; nothing else is in the environment.
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin

mount -t proc proc /proc
mount -t sysfs sysfs /sys
mkdir -p /dev/shm /dev/pts
mount -t tmpfs tmpfs /dev/shm
mount -t devpts devpts /dev/pts
ln -s /proc/self/fd /dev/fd

# Debian's kernel leaves CAN in modules; in this order each finds the one that it needs.
modules=/usr/lib/uml/modules/$(uname -r)/kernel
for module in net/can/can drivers/net/can/dev/can-dev drivers/net/can/vcan \
              net/can/can-raw net/can/can-bcm net/can/can-gw net/sched/sch_netem; do
  insmod "$modules/$module.ko"
done

# This kernel counts processor time in whole ticks of 10 ms: a real-time program that is often at
# work when the tick comes seems to use all of it, and would be stopped for 50 ms in every second.
echo -1 > /proc/sys/kernel/sched_rt_runtime_us

ip link set up dev lo
timeout --kill-after=5 "$LIMIT" "$BOX/command" > "$BOX/output" 2>&1 < /dev/null
echo $? > "$BOX/status"

echo o > /proc/sysrq-trigger  # power off
sleep 60
