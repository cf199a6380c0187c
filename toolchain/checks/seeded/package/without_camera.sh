# SPDX-License-Identifier: Apache-2.0
# expect: it has no usr/share/polygmap/cameras/d435.toml
# The camera that the configuration names.
rm usr/share/polygmap/cameras/d435.toml
