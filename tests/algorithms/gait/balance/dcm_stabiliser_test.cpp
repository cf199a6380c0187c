// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/dcm_stabiliser.hpp"

#include <gtest/gtest.h>

#include "algorithms/core/time.hpp"

namespace polygmap {
namespace {

TEST(DcmStabiliser, PendulumOffItsPlace_ReturnsAndWithoutFeedbackFalls) {
  for (const double gain : {2.0, 0.0}) {
    DcmStabiliser::Params params;
    params.gain = gain;
    DcmStabiliser stabiliser;
    const double w = 3.5;
    Vec2 x{0.01, -0.02}, v = Vec2::Zero();
    for (int tick = 0; tick < 1500; ++tick) {
      const Vec2 zmp = stabiliser.zmp_m(params, {}, x, v, w, kTick_s);
      v += kTick_s * w * w * (x - zmp);
      x += kTick_s * v;
    }
    EXPECT_EQ(x.norm() < 0.01, gain > 0.0) << gain << ": " << x.norm();
  }
}

TEST(DcmStabiliser, LastingError_IntegralIsLimited) {
  DcmStabiliser stabiliser;
  Vec2 zmp = Vec2::Zero();
  for (int tick = 0; tick < 100'000; ++tick) {
    zmp = stabiliser.zmp_m({}, {}, Vec2(0.01, 0), Vec2::Zero(), 3.5, kTick_s);
  }
  EXPECT_NEAR(zmp.x(), DcmStabiliser::Params{}.gain * 0.01 + 0.02, 1e-12);
}

}  // namespace
}  // namespace polygmap
