// SPDX-License-Identifier: Apache-2.0
// expect: status 7
int main() { return 7; }
