# SPDX-License-Identifier: Apache-2.0
# expect: stands: gains=1, drives let go: 12
# The robot would fall.
sed -i 's/exits=0/exits=12/' stands.robot
