# SPDX-License-Identifier: Apache-2.0
# expect: usr/bin/polygmapd has mode 4755 instead of 0755
# Whoever starts it would be root.
chmod 4755 usr/bin/polygmapd
