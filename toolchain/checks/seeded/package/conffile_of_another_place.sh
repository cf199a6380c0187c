# SPDX-License-Identifier: Apache-2.0
# expect: it is no package: .*conffile
# A conffile that the package does not have.
echo /etc/polygmap/robot.toml >DEBIAN/conffiles
