# SPDX-License-Identifier: Apache-2.0
# What scripts in the guest have in common.

# until_true SECONDS COMMAND...: waits for it to succeed.
until_true() {
  local left=$(($1 * 20))
  shift
  until "$@" >/dev/null 2>&1; do
    [ $((left -= 1)) -gt 0 ] || { echo "in vain: $*"; return 1; }
    sleep 0.05
  done
}

# libcamera takes no notice of devices that udev has not dealt with; without start_udev they are marked as if.
mark_devices() {
  [ -z "${udev:-}" ] || return 0
  mkdir -p /run/udev/data
  touch /run/udev/control
  local device
  for device in /sys/class/video4linux/* /sys/bus/media/devices/*; do
    [ ! -e "$device/dev" ] || echo I:1 >"/run/udev/data/c$(cat "$device/dev")"
  done
}

# The real one, for cameras that come and go while libcamera looks.
start_udev() {
  udev=1
  mkdir -p /run/udev
  /lib/systemd/systemd-udevd --daemon
  udevadm trigger --type=all
  udevadm settle
}

# plug_in FOLDER WIDTH HEIGHT FPS [OPTIONS]: the folder's JPEGs as a USB camera; its process is $usb_camera.
plug_in() {
  modprobe vhci-hcd
  modprobe uvcvideo
  modprobe fakefw 2>/dev/null || true
  python3 "$HERE/usb_camera.py" "$@" >>"$OUT/usb-camera" 2>&1 &
  usb_camera=$!
  # Its number differs while somebody still holds the one before.
  until_true 20 compgen -G '/sys/class/video4linux/video*'
  until_true 20 compgen -G '/dev/video*'
  mark_devices
}

pull_out() {
  kill "$usb_camera"
  wait "$usb_camera" || true
}
