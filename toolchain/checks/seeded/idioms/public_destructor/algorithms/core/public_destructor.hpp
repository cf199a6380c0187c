// SPDX-License-Identifier: Apache-2.0
// expect: virtual ~
#pragma once
struct Port {
  virtual ~Port() = default;
};
