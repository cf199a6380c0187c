// SPDX-License-Identifier: Apache-2.0
// What a real depth camera does beside noise, as the module's port and the picture show it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim_stub/robot_camera.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

constexpr int kColumns = kDepthWidth_px, kRows = kDepthHeight_px;

SimOptions options_of(const CameraErrors& errors, std::uint64_t seed = 1) {
  SimOptions options;
  options.seed = seed;
  options.errors = ErrorParams::none();
  options.errors.depth_noise = 0.0;
  options.start = StartPose{0.4, 0.0, 0.0};
  options.stairs.jitter_m = 0.0;
  options.camera.legs_visible = false;
  options.camera.errors = errors;
  return options;
}

struct Arrival {
  std::uint32_t sequence;
  std::int64_t stamp_ns, age_ns;
};
// As a module sees them that looks every 2 ms.
std::vector<Arrival> arrivals(const CameraErrors& errors, int ticks) {
  SimRobot robot(options_of(errors));
  std::vector<Arrival> all;
  DepthFrameView frame;
  for (int i = 0; i < ticks; ++i) {
    while (robot.try_acquire(frame)) {
      all.push_back({frame.sequence, frame.stamp_ns, robot.now_ns() - frame.stamp_ns});
      robot.release();
    }
    robot.advance();
  }
  EXPECT_EQ(robot.depth_camera().overwritten(), 0U);
  return all;
}

TEST(CameraErrors, Drops_FramesAreMissingAndTheirNumbersToo) {
  const std::vector<Arrival> all = arrivals({.drop_share = 0.3}, 10000);
  EXPECT_NEAR(static_cast<double>(all.size()), 0.7 * 600.0, 30.0);
  EXPECT_GT(all.back().sequence, 595U);
}

TEST(CameraErrors, LatencyAndJitter_AgeIsWithinThemAndTheStampIsTheExposures) {
  const std::vector<Arrival> all = arrivals({.latency_s = 0.1, .jitter_s = 0.02}, 3000);
  std::int64_t least_ns = all.front().age_ns, most_ns = least_ns;
  for (const Arrival& frame : all) {
    least_ns = std::min(least_ns, frame.age_ns);
    most_ns = std::max(most_ns, frame.age_ns);
    EXPECT_NEAR(seconds(frame.stamp_ns - VirtualClock::kStart_ns), frame.sequence / 30.0, 0.00101);
  }
  EXPECT_NEAR(seconds(least_ns), 0.130, 0.0025);
  EXPECT_NEAR(seconds(most_ns), 0.150, 0.0025);
}

TEST(CameraErrors, Stamp_IsLaterThanTheExposureAndTheFrameComesAsBefore) {
  const std::vector<Arrival> all = arrivals({.stamp_s = 0.01}, 1000);
  ASSERT_GT(all.size(), 50U);
  for (const Arrival& frame : all) {
    EXPECT_EQ(frame.age_ns, 20 * kNsPerMs);
    EXPECT_NEAR(seconds(frame.stamp_ns - VirtualClock::kStart_ns), frame.sequence / 30.0 + 0.01, 0.00101);
  }
}

TEST(CameraErrors, Reorder_FramesComeAfterTheirSuccessorAndNoneIsLost) {
  const std::vector<Arrival> all = arrivals({.jitter_s = 0.01, .reorder_share = 0.2}, 5000);
  int late = 0;
  for (std::size_t i = 1; i < all.size(); ++i) late += all[i].stamp_ns < all[i - 1].stamp_ns ? 1 : 0;
  EXPECT_NEAR(late, 0.2 * 0.8 * 300.0, 20.0);  // two late ones in a row stay in order
  EXPECT_GE(all.size(), 295U);
}

// A picture of the stairs with what each pixel shows.
class Picture {
 public:
  explicit Picture(const CameraErrors& errors, int skipped = 0, std::uint64_t seed = 1)
      : robot_(options_of(errors, seed)) {
    DepthFrameView frame;
    for (int left = skipped; left >= 0;) {
      if (robot_.try_acquire(frame)) {
        depth_.assign(frame.depth, frame.depth + kColumns * kRows);
        robot_.release();
        --left;
      }
      robot_.advance();
    }
  }
  [[nodiscard]] int raw(int u, int v) const { return depth_[static_cast<std::size_t>(v * kColumns + u)]; }
  [[nodiscard]] const StairWorld& stairs() const { return robot_.stairs(); }
  [[nodiscard]] Vec3 point_m(int u, int v) const {
    const CameraIntrinsics k = robot_camera_intrinsics();
    const Vec3 ray{(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, 1.0};
    return robot_.truth().true_T_base * robot_.errors().base_T_camera * Vec3(k.depth_unit_m * raw(u, v) * ray);
  }

 private:
  SimRobot robot_;
  std::vector<std::uint16_t> depth_;
};

// How many pixels of whole's first tread, so far behind its nosing, have no depth any more.
double lost_share(const Picture& whole, const Picture& holed, double from_m, double to_m) {
  const Step& step = whole.stairs().steps[0];
  int all = 0, lost = 0;
  for (int v = 0; v < kRows; ++v) {
    for (int u = 0; u < kColumns; ++u) {
      if (whole.raw(u, v) == 0) continue;
      const Vec3 p_m = whole.point_m(u, v);
      if (std::abs(p_m.z() - step.height_m) > 0.001 || p_m.x() < step.nosing_x_m + from_m) continue;
      if (p_m.x() > step.nosing_x_m + to_m || std::abs(p_m.y()) > 0.5) continue;
      ++all;
      lost += holed.raw(u, v) == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(all, 1000);
  return static_cast<double>(lost) / all;
}

int differing(const Picture& a, const Picture& b) {
  int count = 0;
  for (int v = 0; v < kRows; ++v) {
    for (int u = 0; u < kColumns; ++u) count += (a.raw(u, v) == 0) != (b.raw(u, v) == 0) ? 1 : 0;
  }
  return count;
}

TEST(CameraErrors, DarkTread_LosesItsShareOfPixelsOthersInEveryFrame) {
  const Picture whole({}), dark({.dark_share = 0.4}), later({.dark_share = 0.4}, 3);
  EXPECT_NEAR(lost_share(whole, dark, 0.01, 0.25), 0.4, 0.05);
  EXPECT_GT(differing(dark, later), 5000);
}

TEST(CameraErrors, ShinyTread_LosesItsShareAlwaysInTheSamePlaces) {
  const Picture whole({}), shiny({.shiny_share = 0.3}), later({.shiny_share = 0.3}, 3);
  EXPECT_NEAR(lost_share(whole, shiny, 0.01, 0.25), 0.3, 0.1);
  EXPECT_LT(differing(shiny, later), 500);  // the robot stands almost still
}

TEST(CameraErrors, HoleTreads_AreThatShareOfTheTreads) {
  const Picture whole({}), none({.dark_share = 0.4, .hole_treads = 0.0});
  EXPECT_EQ(lost_share(whole, none, 0.01, 0.25), 0.0);
}

TEST(CameraErrors, NosingStrip_IsAsWideAsItSaysAndWithoutDepth) {
  const Picture whole({}), strip({.nosing_strip_m = 0.03});
  EXPECT_GT(lost_share(whole, strip, 0.001, 0.029), 0.99);
  EXPECT_EQ(lost_share(whole, strip, 0.031, 0.25), 0.0);
}

TEST(CameraErrors, SunPatch_TakesTheDepthOfOneRoundPlace) {
  int seen = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Picture whole({}, 0, seed), sunny({.sun_patch_m = 0.1}, 0, seed);
    double left_m = -1e9, right_m = 1e9;
    int lost = 0;
    for (int v = 0; v < kRows; ++v) {
      for (int u = 0; u < kColumns; ++u) {
        if (whole.raw(u, v) == 0 || sunny.raw(u, v) != 0) continue;
        ++lost;
        left_m = std::max(left_m, whole.point_m(u, v).y());
        right_m = std::min(right_m, whole.point_m(u, v).y());
      }
    }
    if (lost < 2000) continue;  // it shines where the camera does not look
    ++seen;
    EXPECT_GT(left_m - right_m, 0.15);
    EXPECT_LT(left_m - right_m, 0.4);  // a slanting ray lights more of a riser or of the floor
  }
  EXPECT_GE(seen, 2);
}

// A post in front of a floor: how wide it is in every row that shows it.
double width_px(double fattening_px) {
  const std::vector<SolidBox> solids{{Vec3(0.5, -0.05, 0.0), Vec3(0.6, 0.05, 1.5), 0}};
  DepthRenderer renderer(robot_camera_intrinsics());
  renderer.render(
      {Transform{Mat3::Identity(), Vec3{0, 0, 0.79}} * base_T_camera(), solids, {}, base_T_camera(), false});
  renderer.fatten_edges(fattening_px, CounterNoise(1, Stream::kFatEdges));
  int near = 0, rows = 0;
  for (int v = 0; v < kRows / 4; ++v, ++rows) {
    for (int u = 0; u < kColumns; ++u) near += renderer.inverse_depth(v)[u] > 1.0F / 0.7F ? 1 : 0;
  }
  return static_cast<double>(near) / rows;
}

TEST(CameraErrors, FatEdges_ANearThingIsWiderByThatMuchOnEitherSide) {
  const double usual_px = width_px(0.0);
  ASSERT_GT(usual_px, 20.0);
  EXPECT_NEAR(width_px(1.0) - usual_px, 2.0, 0.1);
  EXPECT_NEAR(width_px(3.0) - usual_px, 6.0, 0.1);
  EXPECT_NEAR(width_px(2.5) - usual_px, 5.0, 0.3);
}

TEST(CameraErrors, FatEdges_OfStairsSeenFromTheFront_MoveNoNosing) {
  const Picture whole({}), fat({.edge_fattening_px = 3.0});
  const double middle_m = 0.3;  // the stairs' sides are edges
  int moved = 0;
  for (int v = kRows / 2; v < kRows; ++v) {
    for (int u = 0; u < kColumns; ++u) {
      if (std::abs(whole.point_m(u, v).y()) < middle_m) moved += std::abs(whole.raw(u, v) - fat.raw(u, v)) > 1 ? 1 : 0;
    }
  }
  EXPECT_EQ(moved, 0);
}

}  // namespace
}  // namespace polygmap::sim
