# SPDX-License-Identifier: Apache-2.0
# expect: unplugged: the status says
# Why it stopped is not told.
sed -i 's/its IMU or its joints fell silent/it stopped/' unplugged.robot
