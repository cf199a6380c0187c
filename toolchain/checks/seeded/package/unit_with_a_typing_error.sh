# SPDX-License-Identifier: Apache-2.0
# expect: systemd-analyze verify says: .*LimitRTPRIOS
# systemd leaves out what it does not know, and the lanes have no real time.
sed -i s/^LimitRTPRIO=/LimitRTPRIOS=/ lib/systemd/system/polygmapd.service
