// SPDX-License-Identifier: Apache-2.0
// Nothing wrong here: the check must say so.
// expect: anything
int value = 0;
