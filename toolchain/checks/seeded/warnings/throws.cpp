// SPDX-License-Identifier: Apache-2.0
// expect: exception
void careless() { throw 1; }
