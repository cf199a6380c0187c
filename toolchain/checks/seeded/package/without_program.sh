# SPDX-License-Identifier: Apache-2.0
# expect: it has no usr/bin/polygmapd
# Nothing to start.
rm usr/bin/polygmapd
