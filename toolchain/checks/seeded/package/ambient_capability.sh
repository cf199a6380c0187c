# SPDX-License-Identifier: Apache-2.0
# expect: its unit says .* instead of AmbientCapabilities=
# A right that the program would have from its start; both lines add up.
sed -i "/^AmbientCapabilities=/aAmbientCapabilities=CAP_SYS_NICE" lib/systemd/system/polygmapd.service
