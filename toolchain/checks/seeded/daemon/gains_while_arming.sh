# SPDX-License-Identifier: Apache-2.0
# expect: arming: gains=1
# Motion before all drives are there.
sed -i 's/gains=0/gains=1/' arming.robot
