#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""dbc_decode FILE.dbc: reads frames, ID#HEX, one a line; prints what canmatrix makes of each: "signal value" pairs."""
import sys

import canmatrix.formats

matrix = canmatrix.formats.loadp_flat(sys.argv[1])
by_id = {frame.arbitration_id.id: frame for frame in matrix.frames}
for line in sys.stdin:
    name, data = line.strip().split("#")
    frame = by_id[int(name, 16)]
    decoded = frame.decode(bytes.fromhex(data))
    print(frame.name, *(f"{signal} {float(value.phys_value)!r}" for signal, value in sorted(decoded.items())))
