// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/extrinsics/toe_detector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "algorithms/perception/image/self_filter.hpp"
#include "algorithms/robot/body_shapes.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

// The left leg as it stands alone while the other one climbs: nearly straight, under the base.
struct Stand {
  double base_z_m = 0.86;
  Vec3 sole_p_m{-0.02, 0.04, 0.0};
  double riser_m = 0.02;  // ahead of the toe
  double rise_m = 0.13;
  bool legs = true;
  std::uint32_t noise_seed = 0;  // 0: none
};

class ToeDetectorTest : public testing::Test {
 protected:
  // What the camera sees, by the true mount.
  void look(const Stand& stand, const Vec3& mount_error_m = Vec3::Zero()) {
    const Transform world_T_base{Mat3::Identity(), Vec3{0.0, 0.0, stand.base_z_m}};
    Transform mount = base_T_camera();
    mount.p_m += mount_error_m;
    test::DepthScene scene;
    scene.intrinsics = robot_camera_intrinsics();
    scene.world_T_camera = world_T_base * mount;
    test::StairSpec stairs;
    stairs.rise_m = stand.rise_m;
    stairs.first_riser_x_m = stand.sole_p_m.x() + kCollisionRectangle.toe_x_m + stand.riser_m;
    scene.add_stairs(stairs);
    const LegGeometry geometry;
    const Transform base_T_sole{Mat3::Identity(), stand.sole_p_m - world_T_base.p_m};
    const LegSolution leg = solve_leg(geometry, Foot::kLeft, base_T_sole);
    ASSERT_TRUE(leg.reachable);
    if (stand.legs)
      scene.legs[0] = transformed(mount.inverse(), base_leg_shapes(nominal_robot(), Foot::kLeft, leg.q_rad));
    test::DepthPicture picture = test::render(scene);
    if (stand.noise_seed > 0) test::add_noise(picture, {.correlated = stand.noise_seed % 2 == 0}, stand.noise_seed);
    raw_ = picture.raw();
    camera_T_sole_ = base_T_camera().inverse() * base_T_sole;  // as believed
  }
  [[nodiscard]] std::optional<ToeSighting> see(const Transform& camera_T_sole) const {
    const CameraIntrinsics k = robot_camera_intrinsics();
    RawRange range;
    range.set({}, k.depth_unit_m);
    ToeDetector detector;
    detector.begin(ToeDetectorParams{}, {1, 1, k.width_px, k.height_px, raw_.data()}, k, range, kSole, camera_T_sole);
    while (!detector.step()) {
    }
    return detector.sighting();
  }
  [[nodiscard]] std::optional<ToeSighting> see() const { return see(camera_T_sole_); }

  std::vector<std::uint16_t> raw_;
  Transform camera_T_sole_;
};

// All lines round to the same row of pixels: a picture knows the toe to half of one, 1 mm.
TEST_F(ToeDetectorTest, CameraMillimetresOff_TheToeIsSeenAsFarOffTheOtherWay) {
  for (const double off_m : {-0.006, 0.0, 0.004}) {
    double sum_m = 0.0;
    int count = 0;
    for (std::uint32_t seed = 0; seed < 4; ++seed) {
      look({.sole_p_m = {-0.03 + 0.006 * seed, 0.04, 0.0}, .noise_seed = seed}, {off_m, 0.0, 0.0});
      const std::optional<ToeSighting> toe = see();
      ASSERT_TRUE(toe.has_value()) << off_m << " " << seed;
      EXPECT_NEAR(toe->ahead_m, -off_m, 0.0016) << seed;
      EXPECT_LT(toe->sigma_m, 0.0015);
      sum_m += toe->ahead_m;
      ++count;
    }
    EXPECT_NEAR(sum_m / count, -off_m, 0.0009) << off_m;
  }
}

TEST_F(ToeDetectorTest, LandingWithoutARiser_IsSeenTheSame) {
  look({.riser_m = 2.0}, {0.004, 0.0, 0.0});
  ASSERT_TRUE(see().has_value());
  EXPECT_NEAR(see()->ahead_m, -0.004, 0.0015);
}

TEST_F(ToeDetectorTest, KneeBentBeforeTheToe_NothingIsSeen) {
  look({.base_z_m = 0.72});
  EXPECT_FALSE(see().has_value());
}

TEST_F(ToeDetectorTest, NoFootThere_NothingIsSeen) {
  look({.legs = false});
  EXPECT_FALSE(see().has_value());
  look({.rise_m = 0.07, .legs = false});  // a tread as high as a foot, which ends nowhere near
  EXPECT_FALSE(see().has_value());
}

TEST_F(ToeDetectorTest, ToeAgainstTheRiser_NothingIsSeen) {
  look({.riser_m = 0.002});
  EXPECT_FALSE(see().has_value());
}

TEST_F(ToeDetectorTest, BeyondWhatIsLookedFor_NothingIsSeen) {
  look({.riser_m = 0.06}, {0.03, 0.0, 0.0});
  EXPECT_FALSE(see().has_value());
}

TEST_F(ToeDetectorTest, BlankPictureOrAPoseThatIsNone_NothingIsSeen) {
  look({});
  ASSERT_TRUE(see().has_value());
  Transform behind = camera_T_sole_, nowhere = camera_T_sole_, aside = camera_T_sole_;
  behind.p_m.z() = -0.8;
  nowhere.p_m.x() = std::numeric_limits<double>::quiet_NaN();
  aside.p_m.x() += 3.0;
  for (const Transform& camera_T_sole : {behind, nowhere, aside}) EXPECT_FALSE(see(camera_T_sole).has_value());
  std::fill(raw_.begin(), raw_.end(), std::uint16_t{0});
  EXPECT_FALSE(see().has_value());
}

}  // namespace
}  // namespace polygmap
