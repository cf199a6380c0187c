# SPDX-License-Identifier: Apache-2.0
# expect: its unit says .* instead of ExecStart=/usr/bin/polygmapd --config /etc/polygmap/polygmapd.toml
# Another configuration than the one that an upgrade keeps.
sed -i s#/etc/polygmap/polygmapd.toml#/usr/share/polygmap/polygmapd.toml# lib/systemd/system/polygmapd.service
