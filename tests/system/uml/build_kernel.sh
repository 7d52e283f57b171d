#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the user-mode Linux kernel that tests with devices boot, from Debian's source: build_kernel.sh FOLDER
#
# FOLDER gets `linux` and `lib/modules`, 12 MB, once all of it is there. In between it takes 2 GB beside it and some ten
# minutes of a core. Needs gcc, make, flex, bison, bc, rsync, kmod, xz and the headers of libelf and OpenSSL. $CC: the
# compiler.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=$(realpath -m "$1")
work=$out.build
source=linux-source-6.12

rm -rf "$work"
mkdir -p "$work"/{source,loop,dist}
cd "$work"
apt-get -o APT::Sandbox::User=root download "$source" v4l2loopback-dkms >/dev/null
for package in *.deb; do dpkg -x "$package" packages; done
tar -xf "packages/usr/src/$source.tar.xz" -C source --strip-components=1
cp -r packages/usr/src/v4l2loopback-*/. loop
cp -r "$here/fakefw" fakefw

make=(make -s ARCH=um ${CC:+"CC=$CC"} -j"$(nproc)")
"${make[@]}" -C source O="$work/kernel" tinyconfig
(cd source && ARCH=um scripts/kconfig/merge_config.sh -m -O "$work/kernel" "$work/kernel/.config" "$here/kernel.config" >/dev/null)
"${make[@]}" -C source O="$work/kernel" olddefconfig
"${make[@]}" -C source O="$work/kernel" linux modules
release=$("${make[@]}" -C source O="$work/kernel" kernelrelease | tail -n 1)
"${make[@]}" -C source O="$work/kernel" modules_install INSTALL_MOD_PATH="$work/dist" INSTALL_MOD_STRIP=1
"${make[@]}" -C kernel M="$work/fakefw" modules
# Its releases for older kernels know strlcpy, which is gone.
"${make[@]}" -C kernel M="$work/loop" KCFLAGS=-Dstrlcpy=strscpy modules
mkdir -p "dist/lib/modules/$release/extra"
cp fakefw/fakefw.ko loop/v4l2loopback.ko "dist/lib/modules/$release/extra"
rm -f "dist/lib/modules/$release"/{build,source}
depmod -b dist "$release"
cp kernel/linux dist/linux
rm -rf "$out"
mv dist "$out"
rm -rf "$work"
