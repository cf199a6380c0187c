# SPDX-License-Identifier: Apache-2.0
# expect: etc/polygmap/polygmapd.toml has mode 0666 instead of 0644
# Whoever is on the robot could name another bus.
chmod 666 etc/polygmap/polygmapd.toml
