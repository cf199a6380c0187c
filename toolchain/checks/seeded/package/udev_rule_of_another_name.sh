# SPDX-License-Identifier: Apache-2.0
# expect: its udev rules make no /dev/polygmap/depth
# The configuration names a device that no rule makes.
sed -i s#polygmap/depth#polygmap/camera# lib/udev/rules.d/60-polygmap.rules
