# SPDX-License-Identifier: Apache-2.0
# expect: its conffiles are \[\]
# An upgrade would overwrite the robot's configuration.
rm DEBIAN/conffiles
