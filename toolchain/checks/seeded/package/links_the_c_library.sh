# SPDX-License-Identifier: Apache-2.0
# expect: polygmapd wants an interpreter or libraries: it is not static
# The robot has another C library.
echo 'int main(void) { return 0; }' | aarch64-linux-gnu-gcc -x c -s -o usr/bin/polygmapd -
