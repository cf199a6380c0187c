// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

class LidarOdometry {
 public:
  // The oldest pose that has arrived and was not yet read; false, and sample untouched, when there is none. Never
  // blocks. Poses that nobody reads push out the oldest.
  [[nodiscard]] virtual bool try_read(LioSample& sample) noexcept = 0;

 protected:
  ~LidarOdometry() = default;
};

}  // namespace polygmap::hal
