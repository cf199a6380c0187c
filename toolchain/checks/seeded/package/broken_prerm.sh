# SPDX-License-Identifier: Apache-2.0
# expect: its prerm is no script
# The package could not be removed any more.
echo "if true; then" >>DEBIAN/prerm
