# SPDX-License-Identifier: Apache-2.0
# expect: stands: the status never was running
# The operator does not see that it stands.
sed -i '/^TOLD STATUS=running/d' stands.robot
