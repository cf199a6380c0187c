# SPDX-License-Identifier: Apache-2.0
"""A recording, its messages, and its CRCs mended after a change: for the scripts in seeded/mcap (run.mcap of this folder),
toolchain/scenes and recordings."""
import struct
import zlib

PATH = "run.mcap"
FOOTER, CHANNEL, MESSAGE, CHUNK, DATA_END = 0x02, 0x04, 0x05, 0x06, 0x0F
HEAD = 9  # opcode, length


def read(path=PATH):
    with open(path, "rb") as file:
        return bytearray(file.read())


def write(data, path=PATH):
    with open(path, "wb") as file:
        file.write(data)


def records(data, at, end):
    """(opcode, begin, content, length) of each"""
    while at + HEAD <= end:
        length = struct.unpack_from("<Q", data, at + 1)[0]
        yield data[at], at, at + HEAD, length
        at += HEAD + length


def top(data):
    return records(data, 8, len(data) - 8)


def messages(data):
    """those in chunks: topic, begin of the record, size of the data, content of the chunk"""
    topics, found = {}, []
    for opcode, _, content, length in top(data):
        if opcode == CHANNEL:
            number, size = struct.unpack_from("<H", data, content)[0], struct.unpack_from("<I", data, content + 4)[0]
            topics[number] = data[content + 8:content + 8 + size].decode()
        if opcode != CHUNK:
            continue
        for inner, begin, inside, size in records(data, content + 40, content + length):
            if inner == MESSAGE:
                found.append({"topic": topics[struct.unpack_from("<H", data, inside)[0]], "begin": begin, "size": size - 22,
                              "chunk": content})
    return found


def repair(data, chunk):
    """the CRC of that chunk (None: of none), of the data section, and of the summary"""
    if chunk is not None:
        length = struct.unpack_from("<Q", data, chunk + 32)[0]
        struct.pack_into("<I", data, chunk + 24, zlib.crc32(memoryview(data)[chunk + 40:chunk + 40 + length]))
    for opcode, begin, content, _ in top(data):
        if opcode == DATA_END:
            struct.pack_into("<I", data, content, zlib.crc32(memoryview(data)[:begin]))
        if opcode == FOOTER:
            summary = struct.unpack_from("<Q", data, content)[0]
            struct.pack_into("<I", data, content + 16, zlib.crc32(memoryview(data)[summary:content + 16]))
