# SPDX-License-Identifier: Apache-2.0
# expect: it has no postinst
# systemd and udev would not read the new files.
rm DEBIAN/postinst
