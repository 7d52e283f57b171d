#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Boots a user-mode Linux kernel on this machine's own file system and runs one script in it as root:
#
#   boot.sh KERNEL SCRIPT OUT [VARIABLE=VALUE ...]
#
# KERNEL: folder with `linux` and `lib/modules`. The guest sees / as it is here but writes to memory; OUT is the one
# folder it shares, as $OUT under the same path. What the script prints goes to OUT/log; its exit code is ours. 124: it
# took longer than $PATIENCE seconds (120). 125: the kernel did not come up. $KERNEL_OPTIONS: more for its command line.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
kernel=$(realpath "$1") script=$(realpath "$2") out=$(realpath "$3")
shift 3

# See legacy_registers.py. What the registers of AVX hold is lost at every page fault then, so nothing there uses them.
launch=() legacy=
if grep -qm1 amx_tile /proc/cpuinfo; then
  launch=(python3 "$here/legacy_registers.py")
  legacy='GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-AVX512VL,-AVX512BW,-AVX_Fast_Unaligned_Load,-ERMS,-FSRM OPENCV_CPU_DISABLE=AVX,AVX2,FMA3,FP16,AVX512F'
fi

{
  echo "export OUT=$out HERE=$here PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root TERM=dumb LC_ALL=C.UTF-8 $legacy"
  for variable in "$@"; do printf 'export %q\n' "$variable"; done
} >"$out/environment"

# Runs first in the guest, while / is still this machine's, read-only.
cat >"$out/init" <<INIT
#!/bin/bash
. "$out/environment"
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t tmpfs memory /mnt
mkdir /mnt/{new,work,root}
mount -t overlay -o lowerdir=/,upperdir=/mnt/new,workdir=/mnt/work,xino=off overlay /mnt/root
root=/mnt/root
mkdir -p \$root/lib/modules
mount -t hostfs -o "$kernel/lib/modules" modules \$root/lib/modules
mount -t devtmpfs dev \$root/dev
mkdir -p \$root/dev/pts \$root/dev/shm
mount -t devpts pts \$root/dev/pts
for folder in /dev/shm /run; do mount -t tmpfs memory \$root\$folder; done
mkdir -p "\$root$out"
mount -t hostfs -o "$out" out "\$root$out"
mount -t proc proc \$root/proc
mount -t sysfs sysfs \$root/sys
mount -t configfs config \$root/sys/kernel/config
exec chroot \$root /bin/bash "$out/payload"
INIT
cat >"$out/payload" <<PAYLOAD
. "$out/environment"
busybox ip link set lo up
. "$here/guest.sh"
(cd /tmp && set -e && . "$script") >"$out/log" 2>&1
echo \$? >"$out/exit-code"
busybox poweroff -f
PAYLOAD
chmod +x "$out/init"
rm -f "$out/exit-code"
# The kernel leads a group of processes that is all of the machine; its id is in machine/guest/pid.
rm -rf "$out/machine"
mkdir "$out/machine"

memory=$(mktemp -d /dev/shm/gyre-guest-XXXXXX)
trap 'rm -rf "$memory"' EXIT
status=0
TMPDIR=$memory HOME=$memory timeout -k 5 "${PATIENCE:-120}" ${launch[@]+"${launch[@]}"} "$kernel/linux" mem="${MEMORY:-1200M}" rootfstype=hostfs rootflags=/ ro \
  init="$out/init" ${KERNEL_OPTIONS:-} quiet loglevel=3 con=null con0=fd:0,fd:1 uml_dir="$out/machine" umid=guest </dev/null >"$out/console" 2>&1 || status=$?
[ -f "$out/exit-code" ] && exit "$(cat "$out/exit-code")"
[ "$status" = 124 ] && exit 124
exit 125
