# SPDX-License-Identifier: Apache-2.0
# expect: it is for 'amd64' instead of arm64
# dpkg on the robot would refuse it.
sed -i "s/^Architecture: .*/Architecture: amd64/" DEBIAN/control
