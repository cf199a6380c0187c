# SPDX-License-Identifier: Apache-2.0
# expect: doctor: no JSON
# A word of the program between its braces.
sed -i '1i polygmapd: looking' doctor.daemon
