# SPDX-License-Identifier: Apache-2.0
# expect: doctor: .*.count.: 10
# Ten wake-ups instead of a thousand.
sed -i 's/"count": 1000,/"count": 10,/' doctor.daemon
