# SPDX-License-Identifier: Apache-2.0
# expect: it has no usr/share/doc/polygmap/deploy.md
# What the unit names as its documentation.
rm usr/share/doc/polygmap/deploy.md
