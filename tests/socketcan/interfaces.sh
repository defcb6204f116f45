#!/bin/sh
# Bring up vcan0 and vcan1, wide enough for CAN FD.
set -e
PATH=/usr/sbin:/usr/bin:/sbin:/bin
for interface in vcan0 vcan1; do
  ip link add dev "$interface" type vcan
  ip link set dev "$interface" mtu 72
  ip link set up dev "$interface"
done
