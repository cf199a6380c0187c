# SPDX-License-Identifier: Apache-2.0
"""Makes the script of the guest's drives (tests/vm/wire_script.hpp) of a bus file and of what the host's simulation logged
of its buses, a log of candump -L."""
import re
import tomllib

FRAME = re.compile(r"\((\d+)\.(\d+)\) (\S+) ([0-9A-Fa-f]{3})#([0-9A-Fa-f]*)")
TICK_US = 2000


class BadLog(Exception):
    """One sentence: file, line and what is wrong."""


def drives_of(bus_file):
    """{(bus, command's id): (reply's id, what byte 0 of a reply says, in which bits)}, and the feet's (bus, id) or None."""
    with open(bus_file, "rb") as file:
        table = tomllib.load(file)
    drives = {}
    for drive in table["drive"]:
        mask = 0x0F if drive.get("reply", "id") == "status_nibble" else 0xFF  # as firmware/config/bus_file.cpp has it
        drives[drive["bus"], drive["id"]] = (drive["reply_id"], drive["id"] & mask, mask)
    feet = table.get("feet")
    return drives, (feet["bus"], feet["id"]) if feet else None


def guest_name(bus):
    """can0 of the bus file is vcan0 in the guest."""
    return "v" + bus if bus.startswith("can") else bus


def script(log, bus_file):
    """The lines of the script. Of each drive the n-th command is tick n's, and its n-th reply the answer to it; the feet's
    frame belongs to the tick of the last command before it, and one before all commands answers none."""
    drives, feet = drives_of(bus_file)
    commands = {key: [] for key in drives}
    replies = {key: [] for key in drives}
    feet_frames = {}
    with open(log) as file:
        for number, line in enumerate(file, 1):
            match = FRAME.match(line)
            if not match:
                raise BadLog(f"{log}:{number}: no line of candump -L")
            bus, frame_id, data = match[3], int(match[4], 16), match[5]
            if (bus, frame_id) in drives:
                commands[bus, frame_id].append(data)
            elif feet == (bus, frame_id):
                feet_frames[max(map(len, commands.values())) - 1] = data
            else:
                key = next((k for k, (reply_id, name, mask) in drives.items()
                            if k[0] == bus and reply_id == frame_id and data and int(data[:2], 16) & mask == name), None)
                if key is None:
                    raise BadLog(f"{log}:{number}: a frame that nothing of {bus_file} sends")
                replies[key].append(data)
    ticks = min(map(len, (*commands.values(), *replies.values())))
    if not ticks:
        raise BadLog(f"{log}: a drive is never commanded, or never answers")
    for tick in range(ticks):
        for (bus, frame_id), (reply_id, *_) in drives.items():
            yield f"{tick} expect {guest_name(bus)} {frame_id:03X}#{commands[bus, frame_id][tick]}"
            yield f"{tick} answer {guest_name(bus)} {reply_id:03X}#{replies[bus, frame_id][tick]}"
        if tick in feet_frames:
            yield f"{tick} say {guest_name(feet[0])} {feet[1]:03X}#{feet_frames[tick]}"
