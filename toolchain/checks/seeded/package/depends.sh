# SPDX-License-Identifier: Apache-2.0
# expect: it depends on libc6 .* .Depends.
# A package that drags others onto the robot.
echo 'Depends: libc6 (>= 2.36)' >>DEBIAN/control
