# SPDX-License-Identifier: Apache-2.0
# expect: etc/polygmap belongs to [0-9]+:[0-9]+ instead of root
# A user's number of the building machine, which is somebody else's on the robot.
: >../options  # of dpkg-deb: owners as they are here
[ "$(id -u)" != 0 ] || chown 1000:1000 etc/polygmap
