// SPDX-License-Identifier: Apache-2.0
// States no reason.
#ifndef POSITIVE_CONTROL
int value = undeclared;
#endif
