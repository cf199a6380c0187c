# SPDX-License-Identifier: Apache-2.0
# expect: its LICENSE is not the project's
# Cut short.
sed -i 20q usr/share/doc/polygmap/LICENSE
