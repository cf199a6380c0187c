# SPDX-License-Identifier: Apache-2.0
# expect: it has no usr/share/polygmap/dbc/ruiwo.dbc
# The host's tool did not write it.
rm usr/share/polygmap/dbc/ruiwo.dbc
