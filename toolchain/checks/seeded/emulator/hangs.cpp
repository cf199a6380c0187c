// SPDX-License-Identifier: Apache-2.0
// expect: status 124
int main() {
  volatile bool forever = true;
  while (forever) {
  }
}
