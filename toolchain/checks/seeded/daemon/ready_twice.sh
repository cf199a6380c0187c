# SPDX-License-Identifier: Apache-2.0
# expect: unprivileged: the service manager was told
# It began twice.
sed -i 's/^TOLD READY=1/&\n&/' unprivileged.robot
