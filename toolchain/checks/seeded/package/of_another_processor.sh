# SPDX-License-Identifier: Apache-2.0
# expect: polygmapd is no program of AArch64
# This machine's program instead of the robot's.
cp /bin/true usr/bin/polygmapd
