# SPDX-License-Identifier: Apache-2.0
# expect: it has no etc/polygmap/polygmapd.toml
# A service without a file.
rm etc/polygmap/polygmapd.toml DEBIAN/conffiles
