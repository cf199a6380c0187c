# SPDX-License-Identifier: Apache-2.0
# expect: its polygmapd does not take its polygmapd.toml: no key
# The program and the configuration of two versions.
printf '%s\n' '#include <stdio.h>' 'int main(void) { puts("no key"); return 2; }' | aarch64-linux-gnu-gcc -x c -static -s -o usr/bin/polygmapd -
