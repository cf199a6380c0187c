# SPDX-License-Identifier: Apache-2.0
"""Depth pictures of 640 x 480 with 16 bits in 1/5000 m, as ../shared/data/depth has them, for programs that read raw depths
in the camera's units of 0.25 mm."""
import array
import struct
import sys
import zlib

SCALES = (0.8, 0.4)  # of 1/5000 m in 0.25 mm; and twice as near


def depths(png):
    """Of a grey PNG of 640 x 480 with 16 bits and no interlacing. ValueError or OSError: it is none, or cannot be read."""
    data, at, size, packed = png.read_bytes(), 8, None, b""
    if not data.startswith(b"\x89PNG\r\n\x1a\n"):
        raise ValueError("it is no PNG")
    while at + 12 <= len(data):
        (length,), kind = struct.unpack(">I", data[at:at + 4]), data[at + 4:at + 8]
        chunk = data[at + 8:at + 8 + length]
        at += 12 + length
        if kind == b"IHDR" and len(chunk) == 13:
            width, height, bits, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunk)
            if (width, height, bits, colour, interlaced) != (640, 480, 16, 0, 0):
                raise ValueError(f"it is a PNG of {width} x {height}, {bits} bits, colour type {colour}, not a grey one of "
                                 "640 x 480 with 16 bits and no interlacing")
            size = width, height
        elif kind == b"IDAT":
            packed += chunk
    if size is None:
        raise ValueError("it has no header")
    try:
        rows = zlib.decompress(packed)
    except zlib.error as error:
        raise ValueError(f"its pixels cannot be unpacked: {error}") from error
    stride, before = 2 * size[0], bytearray(2 * size[0])
    if len(rows) != size[1] * (stride + 1):
        raise ValueError(f"it unpacks to {len(rows)} bytes, not {size[1] * (stride + 1)}")
    out = array.array("H")
    for r in range(size[1]):
        how, line = rows[r * (stride + 1)], bytearray(rows[r * (stride + 1) + 1:(r + 1) * (stride + 1)])
        for i in range(stride):
            a, b, c = (line[i - 2] if i >= 2 else 0), before[i], (before[i - 2] if i >= 2 else 0)
            if how == 1:
                line[i] = (line[i] + a) & 255
            elif how == 2:
                line[i] = (line[i] + b) & 255
            elif how == 3:
                line[i] = (line[i] + (a + b) // 2) & 255
            elif how == 4:
                p = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
                line[i] = (line[i] + p) & 255
        before = line
        row = array.array("H", bytes(line))
        if sys.byteorder == "little":
            row.byteswap()
        out.extend(row)
    return out


def write_raws(pngs, folder):
    """Every picture at both SCALES, as files in folder; their paths. ValueError or OSError names the picture."""
    raws = []
    for number, png in enumerate(pngs):
        try:
            picture = depths(png)
        except (OSError, ValueError) as error:
            raise ValueError(f"the picture {png} is not counted: {error}") from error
        for scale in SCALES:
            raw = folder / f"{number}-{scale}.raw"
            raw.write_bytes(array.array("H", (round(d * scale) for d in picture)).tobytes())
            raws.append(raw)
    return raws
