# SPDX-License-Identifier: Apache-2.0
# expect: no_device: exit code 0 instead of 3
# A bus that is not there is taken.
echo 0 >no_device.code
