# SPDX-License-Identifier: Apache-2.0
# expect: doctor: camera is warning
# The device that is there is doubted.
sed -i '/"camera"/s/"good"/"warning"/' doctor.daemon
