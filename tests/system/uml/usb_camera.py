#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A USB camera that is a process: it serves a folder of JPEGs as MJPEG, and grey pictures as YUYV.

usb_camera.py FOLDER WIDTH HEIGHT FPS [--torn N]

The kernel's virtual host controller (vhci_hcd) takes the other end of a socket for a device on its bus; over it goes
the USB/IP protocol. What is answered is a device of the USB Video Class 1.0 with bulk transfers: the kernel's own
uvcvideo drives it. SIGTERM pulls the plug. --torn: every Nth picture stops half-way. One line is printed per event.
"""

import argparse
import os
import signal
import socket
import struct
import sys
import threading
import time
from pathlib import Path

CONTROLLER = Path("/sys/devices/platform/vhci_hcd.0")
PAYLOAD = 16384  # bytes a transfer; must stay below half a picture
EPIPE, ECONNRESET = 32, 104
HIGH_SPEED = 3

u16 = struct.Struct("<H").pack
u32 = struct.Struct("<I").pack
i16 = struct.Struct("<h").pack


def class_specific(subtype, *parts):
    body = b"".join(part if isinstance(part, bytes) else bytes([part]) for part in parts)
    return bytes([3 + len(body), 0x24, subtype]) + body


class Descriptors:
    """UVC 1.0: a camera terminal with exposure, a processing unit with brightness and gain, one stream of two formats."""

    strings = ["", "Gyre tests", "Recorded camera", "0001"]

    def __init__(self, width, height, fps):
        self.interval = 10_000_000 // fps
        self.frame_bytes = 2 * width * height
        rate = u32(8 * self.frame_bytes), u32(8 * self.frame_bytes * fps)

        def frame(subtype):
            size = u16(width) + u16(height)
            return class_specific(subtype, 1, 0, size, *rate, u32(self.frame_bytes), u32(self.interval), 1, u32(self.interval))

        colour = class_specific(0x0D, 1, 1, 4)
        yuy2 = b"YUY2" + bytes.fromhex("00001000800000aa00389b71")  # its GUID
        mjpeg = class_specific(6, 1, 1, 1, 1, 0, 0, 0, 0) + frame(7) + colour
        yuyv = class_specific(4, 2, 1, yuy2, 16, 1, 0, 0, 0, 0) + frame(5) + colour
        units = (
            class_specific(2, 1, u16(0x0201), 0, 0, u16(0), u16(0), u16(0), 3, b"\x0a\x00\x00")
            + class_specific(5, 2, 1, u16(0), 2, b"\x01\x02", 0)
            + class_specific(3, 3, u16(0x0101), 0, 2, 0)
        )
        control = class_specific(1, u16(0x0100), u16(13 + len(units)), u32(48_000_000), 1, 1) + units
        formats = mjpeg + yuyv
        stream = class_specific(1, 2, u16(15 + len(formats)), 0x81, 0, 3, 0, 0, 0, 1, 0, 0) + formats
        interfaces = (
            bytes([8, 11, 0, 2, 0x0E, 3, 0, 0])
            + bytes([9, 4, 0, 0, 0, 0x0E, 1, 0, 2]) + control
            + bytes([9, 4, 1, 0, 1, 0x0E, 2, 0, 0]) + stream
            + bytes([7, 5, 0x81, 2]) + u16(512) + b"\0"
        )
        self.configuration = bytes([9, 2]) + u16(9 + len(interfaces)) + bytes([2, 1, 0, 0x80, 50]) + interfaces
        self.device = bytes([18, 1]) + u16(0x0200) + bytes([0xEF, 2, 1, 64]) + u16(0x1D6B) + u16(0x0102) + u16(0x0100) + bytes([1, 2, 3, 1])

    def get(self, kind, index):
        if kind == 1:
            return self.device
        if kind == 2:
            return self.configuration
        if kind == 3 and index == 0:
            return b"\x04\x03\x09\x04"
        if kind == 3 and index < len(self.strings):
            text = self.strings[index].encode("utf-16-le")
            return bytes([2 + len(text), 3]) + text
        return None


class Control:
    """One control of a unit, for the requests of UVC 1.0 table 4-3."""

    def __init__(self, default, least, most, step):
        self.current, self.default, self.least, self.most, self.step = default, default, least, most, step

    def get(self, request):
        answers = {0x81: self.current, 0x82: self.least, 0x83: self.most, 0x84: self.step, 0x87: self.default}
        return {**answers, 0x85: u16(len(self.default)), 0x86: b"\x03"}[request]


class Camera:
    def __init__(self, descriptors):
        self.descriptors = descriptors
        self.probe = bytearray(struct.pack("<HBBIHHHHHII", 1, 1, 1, descriptors.interval, 0, 0, 0, 0, 0, descriptors.frame_bytes, PAYLOAD))
        self.controls = {
            (1, 2): Control(b"\x08", b"\x01", b"\x08", b"\x0b"),  # automatic exposure: aperture priority, or manual
            (1, 4): Control(u32(156), u32(1), u32(10000), u32(1)),  # exposure, units of 100 us
            (2, 2): Control(i16(0), i16(-64), i16(64), i16(1)),  # brightness
            (2, 4): Control(u16(16), u16(0), u16(255), u16(1)),  # gain
        }

    @property
    def is_mjpeg(self):
        return self.probe[2] == 1

    def request(self, setup, data):
        """The answer to a request on endpoint 0; None stalls it."""
        kind, request, value, index, _ = struct.unpack("<BBHHH", setup)
        if kind == 0x80 and request == 6:
            return self.descriptors.get(value >> 8, value & 255)
        if kind == 0x80 and request == 0:
            return b"\0\0"
        if kind < 3:
            return b""
        if kind & 0x7F != 0x21:
            return None
        selector = value >> 8
        if index & 255 == 1 and selector in (1, 2):
            return self.negotiate(request, selector == 2, data)
        control = self.controls.get((index >> 8, selector))
        if index & 255 != 0 or control is None:
            return None
        if request != 1:
            return control.get(request)
        control.current = bytes(data)
        print(f"control {index >> 8}.{selector} {data.hex()}", flush=True)
        return b""

    def negotiate(self, request, commit, data):
        if request != 1:
            return {0x85: u16(len(self.probe)), 0x86: b"\x03"}.get(request, bytes(self.probe))
        self.probe[2:4] = bytes([data[2] if data[2] in (1, 2) else 1, 1])
        self.probe[4:8] = u32(self.descriptors.interval)
        if commit:
            print("format", "MJPG" if self.is_mjpeg else "YUYV", flush=True)
        return b""


class Link:
    """The wire to the host controller: USB/IP, as Documentation/usb/usbip_protocol.rst has it."""

    def __init__(self, camera, pictures, fps, torn):
        self.camera, self.pictures, self.fps, self.torn = camera, pictures, fps, torn
        self.changed = threading.Condition()
        self.asked = []  # (sequence number, length) of transfers the host waits for
        self.socket, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        ports = [line.split() for line in (CONTROLLER / "status").read_text().splitlines()[1:]]
        self.port = next(int(fields[1]) for fields in ports if fields[0] == "hs" and fields[2] == "004")
        (CONTROLLER / "attach").write_text(f"{self.port} {other.fileno()} {1 << 16 | 2} {HIGH_SPEED}")
        other.close()
        print("plugged in", flush=True)

    def unplug(self, *_):
        print("unplugged", flush=True)
        (CONTROLLER / "detach").write_text(str(self.port))
        os._exit(0)

    def receive(self, size):
        data = b""
        while len(data) < size:
            part = self.socket.recv(size - len(data))
            if not part:
                os._exit(0)
            data += part
        return data

    def answer(self, sequence, status=0, data=b"", length=None):
        header = struct.pack(">IIIIIiiiii8x", 3, sequence, 0, 0, 0, status, len(data) if length is None else length, 0, 0, 0)
        self.socket.sendall(header + data)

    def serve(self):
        while True:
            header = self.receive(48)
            command, sequence, _, direction, endpoint = struct.unpack(">5I", header[:20])
            if command == 2:
                self.unlink(sequence, struct.unpack(">I", header[20:24])[0])
                continue
            length = struct.unpack(">i", header[24:28])[0]
            data = self.receive(length) if direction == 0 and length > 0 else b""
            with self.changed:
                if endpoint != 0:
                    self.asked.append((sequence, length))
                    self.changed.notify()
                    continue
                answer = self.camera.request(header[40:48], data)
                if answer is None:
                    self.answer(sequence, -EPIPE)
                elif direction == 1:
                    self.answer(sequence, data=answer[:length])
                else:
                    self.answer(sequence, length=length)

    def unlink(self, sequence, unwanted):
        with self.changed:
            waiting = [entry for entry in self.asked if entry[0] == unwanted]
            for entry in waiting:
                self.asked.remove(entry)
            self.socket.sendall(struct.pack(">IIIIIi24x", 4, sequence, 0, 0, 0, -ECONNRESET if waiting else 0))

    def stream(self):
        count, toggle, due = 0, 0, time.monotonic()
        while True:
            with self.changed:
                while not self.asked:
                    self.changed.wait()
            now = time.monotonic()
            due = max(due, now - 1.0)
            time.sleep(max(0.0, due - now))
            due += 1.0 / self.fps
            count += 1
            picture = self.pictures[(count - 1) % len(self.pictures)]
            if not self.camera.is_mjpeg:
                picture = bytes([count * 16 & 255, 128]) * (self.camera.descriptors.frame_bytes // 2)
            if self.torn and count % self.torn == 0:
                picture = picture[: len(picture) // 2]
            if self.send(picture, toggle):
                toggle ^= 1

    def send(self, picture, toggle):
        """One picture, in as many transfers as it takes; False when the host stopped asking on the way."""
        sent = 0
        while sent < len(picture):
            with self.changed:
                while not self.asked:
                    if not self.changed.wait(1.0):
                        return sent > 0
                sequence, length = self.asked.pop(0)
                part = picture[sent : sent + length - 2]
                sent += len(part)
                last = 2 if sent >= len(picture) else 0
                self.answer(sequence, data=bytes([2, 0x80 | toggle | last]) + part)
        return True


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("width", type=int)
    parser.add_argument("height", type=int)
    parser.add_argument("fps", type=int)
    parser.add_argument("--torn", type=int, default=0)
    given = parser.parse_args()
    pictures = [file.read_bytes() for file in sorted(given.folder.glob("*.jpg"))]
    if not pictures:
        sys.exit(f"no JPEGs in {given.folder}")
    link = Link(Camera(Descriptors(given.width, given.height, given.fps)), pictures, given.fps, given.torn)
    signal.signal(signal.SIGTERM, link.unplug)
    for work in (link.serve, link.stream):
        threading.Thread(target=work, daemon=True).start()
    while True:
        signal.pause()


if __name__ == "__main__":
    main()
