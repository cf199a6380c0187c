// SPDX-License-Identifier: Apache-2.0
// Fails, but not for the reason it states: the check must say so.
// expect: a container without room is a mistake
#ifndef POSITIVE_CONTROL
int value = undeclared;
#endif
