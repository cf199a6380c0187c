# SPDX-License-Identifier: Apache-2.0
# expect: schema sensor_msgs/msg/Imu: sensor_msgs/Imu is ".*angular_velocitz.*", where its publisher has
# A field of the IMU's message has another name than its publisher gave it; every CRC is mended.
import mcap_change as change

data = change.read()
wrong = bytearray(bytes(data).replace(b"Vector3 angular_velocity\n", b"Vector3 angular_velocitz\n"))
assert wrong != data
change.repair(wrong, None)
change.write(wrong)
