// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

class Imu {
 public:
  // The oldest sample not yet read, stamps strictly increasing; false, and sample untouched, when there is none. Never
  // blocks. Samples that nobody reads push out the oldest.
  [[nodiscard]] virtual bool try_read(ImuSample& sample) noexcept = 0;

 protected:
  ~Imu() = default;
};

}  // namespace polygmap::hal
