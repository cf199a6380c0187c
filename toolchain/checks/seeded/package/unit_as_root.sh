# SPDX-License-Identifier: Apache-2.0
# expect: its unit says .* instead of DynamicUser=yes
# The service would run as root.
sed -i /^DynamicUser/d lib/systemd/system/polygmapd.service
