# SPDX-License-Identifier: Apache-2.0
# expect: its copyright says nothing of toml.., which the program has in it
# MIT asks for its notice.
sed -i s/toml++/another/ usr/share/doc/polygmap/copyright
