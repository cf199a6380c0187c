# SPDX-License-Identifier: Apache-2.0
# expect: arming: its devices are \['camera', 'lio'
# A device that tells of no counters.
sed -i '/^device imu /d' arming.daemon
