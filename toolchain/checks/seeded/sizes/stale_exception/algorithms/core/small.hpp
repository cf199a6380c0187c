// SPDX-License-Identifier: Apache-2.0
// expect: small.hpp:Small is no longer needed
#pragma once
class Small {
  int a_ = 0;
};
