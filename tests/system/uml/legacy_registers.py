#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs a program for which the machine has no extended registers beyond those of SSE.

User-mode Linux up to 6.12 has room for 2696 bytes of them and cannot start where there are more, as with AMX. It makes
do with the old ones when asking for the others fails: a filter on its system calls sees to that.
"""

import ctypes
import os
import struct
import sys

PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
LOAD, JUMP_IF_EQUAL, RETURN = 0x20, 0x15, 0x06
ALLOW, FAIL = 0x7FFF0000, 0x00050000 | 5  # EIO
PTRACE, GETREGSET, XSTATE = 101, 0x4204, 0x202  # x86-64


def main():
    arguments = 16  # offset of the first one, 8 bytes each; the number of the call is at 0
    program = [
        (LOAD, 0, 0, 0),
        (JUMP_IF_EQUAL, 0, 5, PTRACE),
        (LOAD, 0, 0, arguments),
        (JUMP_IF_EQUAL, 0, 3, GETREGSET),
        (LOAD, 0, 0, arguments + 16),
        (JUMP_IF_EQUAL, 0, 1, XSTATE),
        (RETURN, 0, 0, FAIL),
        (RETURN, 0, 0, ALLOW),
    ]
    code = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *step) for step in program))
    filters = ctypes.create_string_buffer(struct.pack("=HxxxxxxQ", len(program), ctypes.addressof(code)))
    libc = ctypes.CDLL(None, use_errno=True)
    for call in ((PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0), (PR_SET_SECCOMP, SECCOMP_MODE_FILTER, ctypes.byref(filters), 0, 0)):
        if libc.prctl(*call) != 0:
            sys.exit(f"prctl: {os.strerror(ctypes.get_errno())}")
    os.execv(sys.argv[1], sys.argv[1:])


if __name__ == "__main__":
    main()
