# SPDX-License-Identifier: Apache-2.0
# expect: usr/bin/polygmapd has mode 0644 instead of 0755
# The service could not start.
chmod 644 usr/bin/polygmapd
