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

# plug_panel: a GPIO chip labelled gyre-panel with a button (line 2) and three lights (3 to 5); $panel holds its lines.
plug_panel() {
  modprobe gpio-sim
  local config=/sys/kernel/config/gpio-sim/panel number=2 name
  mkdir -p $config/bank0
  echo gyre-panel >$config/bank0/label
  echo 8 >$config/bank0/num_lines
  for name in BUTTON RED GREEN BLUE; do
    mkdir $config/bank0/line$number
    echo GYRE_$name >$config/bank0/line$number/name
    number=$((number + 1))
  done
  echo 1 >$config/live
  panel=/sys/devices/platform/$(cat $config/dev_name)/$(cat $config/bank0/chip_name)
  chip=$(cat $config/bank0/chip_name)
  until_true 10 test -c "/dev/$chip"
  # Not pressed: the button pulls the line down.
  echo pull-up >"$panel/sim_gpio2/pull"
}

pull_panel() {
  local config=/sys/kernel/config/gpio-sim/panel
  echo 0 >$config/live
  rmdir $config/bank0/line* $config/bank0 $config
}

# rest SECONDS: sleeps without starting a program, which takes its time on a busy machine.
mkfifo /run/silence
rest() {
  read -rt "$1" 9<>/run/silence <&9 || true
}

# press SECONDS: holds the button for that long.
press() {
  echo pull-down >"$panel/sim_gpio2/pull"
  rest "$1"
  echo pull-up >"$panel/sim_gpio2/pull"
  rest 0.1
}

# lights: what the three show, as "100" for red.
lights() {
  echo "$(cat "$panel/sim_gpio3/value")$(cat "$panel/sim_gpio4/value")$(cat "$panel/sim_gpio5/value")"
}
