# SPDX-License-Identifier: Apache-2.0
# expect: it has no usr/share/doc/polygmap/LICENSE
# Apache-2.0 asks for it.
rm usr/share/doc/polygmap/LICENSE
