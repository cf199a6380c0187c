# SPDX-License-Identifier: Apache-2.0
# expect: topic /imu, message \d+: its number is \d+: one is missing
# One sample of the IMU becomes a record that nobody knows, which readers pass over; every CRC is mended.
import mcap_change as change

PRIVATE = 0x80
data = change.read()
message = [m for m in change.messages(data) if m["topic"] == "/imu"][100]
data[message["begin"]] = PRIVATE
change.repair(data, message["chunk"])
change.write(data)
