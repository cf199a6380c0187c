# SPDX-License-Identifier: Apache-2.0
# expect: it has no lib/systemd/system/polygmapd.service
# A program that no service manager starts.
rm lib/systemd/system/polygmapd.service
