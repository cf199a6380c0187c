# SPDX-License-Identifier: Apache-2.0
# expect: polygmapd is not stripped
# Names of all functions, megabytes of them.
echo 'int main(void) { return 0; }' | aarch64-linux-gnu-gcc -x c -static -o usr/bin/polygmapd -
