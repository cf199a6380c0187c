# SPDX-License-Identifier: Apache-2.0
# expect: stands: the drives heard .*3000
# Half a second of commands in three seconds.
sed -i 's/commands=[0-9]*/commands=3000/' stands.robot
