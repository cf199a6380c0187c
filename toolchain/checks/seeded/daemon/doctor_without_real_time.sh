# SPDX-License-Identifier: Apache-2.0
# expect: doctor: .*.real_time.: False
# Wake-ups of a thread without priority say nothing.
sed -i 's/"real_time": true/"real_time": false/' doctor.daemon
