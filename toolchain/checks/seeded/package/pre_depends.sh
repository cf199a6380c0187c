# SPDX-License-Identifier: Apache-2.0
# expect: it depends on systemd .Pre-Depends.
# The other field that says so.
echo 'Pre-Depends: systemd' >>DEBIAN/control
