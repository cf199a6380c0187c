// SPDX-License-Identifier: Apache-2.0
// expect: <vector> is not on target code's list
#include <vector>
