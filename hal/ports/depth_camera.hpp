// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

class DepthCamera {
 public:
  // Fixed from the start; every frame has this size.
  [[nodiscard]] virtual CameraIntrinsics intrinsics() const noexcept = 0;
  // The oldest frame that has arrived and was not yet acquired, stamps and sequence strictly increasing; false, and
  // frame untouched, when there is none. Never blocks. The view and its pixels stay valid until release(), whatever
  // arrives meanwhile, a restart of the stream included. At most one frame is held: acquiring again without release()
  // returns false. Frames that nobody acquires push out the oldest, which leaves a gap in the sequence.
  [[nodiscard]] virtual bool try_acquire(DepthFrameView& frame) noexcept = 0;
  // Without effect when no frame is held.
  virtual void release() noexcept = 0;

 protected:
  ~DepthCamera() = default;
};

}  // namespace polygmap::hal
