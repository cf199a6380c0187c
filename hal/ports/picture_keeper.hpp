// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

// A picture that the module holds, kept by the driver for a second holder after the module has released it.
class PictureKeeper {
 public:
  // How many pictures a driver may be asked to keep at a time.
  static constexpr std::size_t kMostKept = 4;

  // The picture that was acquired last: its pixels stay as they are until let_go(). False: it cannot be kept.
  [[nodiscard]] virtual bool try_keep(const DepthFrameView& frame) noexcept = 0;
  // pixels: of a picture that is kept. Both in the module's perception lane.
  virtual void let_go(const std::uint16_t* pixels) noexcept = 0;

 protected:
  ~PictureKeeper() = default;
};

}  // namespace polygmap::hal
