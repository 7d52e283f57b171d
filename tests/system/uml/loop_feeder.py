#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Puts a folder of JPEGs into a v4l2loopback device, over and over: loop_feeder.py FOLDER DEVICE WIDTH HEIGHT FPS."""

import fcntl
import struct
import sys
import time
from pathlib import Path

VIDIOC_S_FMT = 0xC0D05605
OUTPUT, NO_FIELD, JPEG_COLOURS = 2, 1, 7
MJPEG = int.from_bytes(b"MJPG", "little")


def main():
    folder, device, width, height, fps = sys.argv[1:6]
    pictures = [file.read_bytes() for file in sorted(Path(folder).glob("*.jpg"))]
    size = 2 * int(width) * int(height)
    picture_format = struct.pack("<8I", int(width), int(height), MJPEG, NO_FIELD, 0, size, JPEG_COLOURS, 0)
    wanted = struct.pack("<II", OUTPUT, 0) + picture_format.ljust(200, b"\0")
    with open(device, "wb", buffering=0) as loop:
        fcntl.ioctl(loop, VIDIOC_S_FMT, wanted)
        while True:
            for picture in pictures:
                loop.write(picture)
                time.sleep(1.0 / float(fps))


if __name__ == "__main__":
    main()
