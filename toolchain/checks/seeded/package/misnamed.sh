# SPDX-License-Identifier: Apache-2.0
# expect: its name is 'polygmapd' instead of polygmap
# Beside the installed one instead of in its place.
sed -i "s/^Package: .*/Package: polygmapd/" DEBIAN/control
