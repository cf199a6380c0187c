# SPDX-License-Identifier: Apache-2.0
# expect: it has no usr/share/polygmap/buses/damiao.toml
# One of the shipped buses is left out.
rm usr/share/polygmap/buses/damiao.toml
