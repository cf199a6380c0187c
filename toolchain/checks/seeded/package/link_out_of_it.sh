# SPDX-License-Identifier: Apache-2.0
# expect: usr/share/polygmap/cameras/d435.toml is neither a file nor a folder
# It leads to a file of the machine that built it.
ln -sf "$PWD"/firmware/cameras/d435.toml usr/share/polygmap/cameras/d435.toml
