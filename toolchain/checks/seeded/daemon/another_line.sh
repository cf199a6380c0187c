# SPDX-License-Identifier: Apache-2.0
# expect: no_camera: exit code 3 instead of 3, or not
# The sentence names another line of the file.
sed -i 's/line 32/line 1/' no_camera.said
