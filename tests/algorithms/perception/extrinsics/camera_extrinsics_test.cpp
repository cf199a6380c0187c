// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/extrinsics/camera_extrinsics.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

constexpr double kDegree = kPi / 180.0;
constexpr std::int64_t kFrame_ns = 33 * kNsPerMs;

// A robot on level ground whose camera is mounted otherwise than its data sheet says.
class Robot {
 public:
  Robot(double roll_rad, double pitch_rad, const Vec3& shift_m) {
    const Transform nominal = base_T_camera();
    true_mount_ = {rotation_y(pitch_rad) * rotation_x(roll_rad) * nominal.R, nominal.p_m + shift_m};
    for (const double side : {1.0, -1.0}) {
      stance_.base_T_sole[side > 0 ? 0 : 1].p_m = {0.0, side * kStanceHalfWidth_m, -kNominalBaseHeight_m};
    }
    stance_.stands = {true, true};
  }
  // A surface at a height above the soles that rises by tilt_rad ahead.
  void see(double height_m, double tilt_rad = 0.0, double noise_rad = 0.0) {
    const Transform camera_T_base = true_mount_.inverse();
    std::normal_distribution<> noise(0.0, noise_rad);
    SurfacePatch patch;
    patch.kind = SurfaceKind::kTread;
    const Vec3 normal = rotation_y(-tilt_rad + noise(random_)) * rotation_x(noise(random_)) * Vec3::UnitZ();
    patch.normal = camera_T_base.R * normal;
    patch.centroid_m = camera_T_base * Vec3{0.6, 0.0, height_m - kNominalBaseHeight_m};
    patch.d_m = -patch.normal.dot(patch.centroid_m);
    patch.tilt_sigma_rad = 0.002;
    patch.area_m2 = 0.3;
    ASSERT_TRUE(frame_.surfaces.try_push_back(patch));
  }
  // A standing foot's toe, as far ahead of where encoders and data sheet have it; the picture shows the mount's error
  // as the toe's, and what the mount is tilted by at the height of the feet.
  void detect_toe(const CameraExtrinsicsEstimator& mount, std::size_t foot, double noise_m = 0.0,
                  double ahead_m = 0.0) {
    std::normal_distribution<> noise(0.0, noise_m);
    const SoleModel& sole = nominal_robot().sole;
    const Vec3 edge_m{sole.collision.toe_x_m, 0.0, sole.collision_height_m};
    const Vec3 base_p_edge = stance_.base_T_sole[foot] * edge_m;
    // Seen by its bearing on the upper face, which it is known to lie on.
    const Vec3 ray = mount.base_T_camera().R * (true_mount_.inverse() * base_p_edge);
    const Vec3& from = mount.base_T_camera().p_m;
    const double seen_m = from.x() + ray.x() * (base_p_edge.z() - from.z()) / ray.z() - base_p_edge.x();
    stance_.toes[foot] = ToeSighting{ahead_m + seen_m + (noise_m > 0.0 ? noise(random_) : 0.0), 0.0006, edge_m};
  }
  SurfacePatch& last() { return frame_.surfaces.back(); }
  CameraExtrinsicsEstimator::Stance& stance() { return stance_; }
  void deliver(CameraExtrinsicsEstimator& mount) {
    frame_.stamp_ns += kFrame_ns;
    mount.update(frame_, stance_);
    frame_.surfaces.clear();
    stance_.toes.fill(std::nullopt);
  }

 private:
  Transform true_mount_;
  CameraExtrinsicsEstimator::Stance stance_;
  SurfaceFrame frame_;
  std::mt19937 random_{1};
};

CameraExtrinsicsEstimator estimator() { return {CameraExtrinsicsEstimator::Params{}, base_T_camera()}; }
// Of the toes' upper edges below the camera, where both feet stand on the floor.
const double kToesBelow_m = kNominalBaseHeight_m + base_T_camera().p_m.z() - nominal_robot().sole.collision_height_m;

// That has no doubt of its feet's length.
CameraExtrinsicsEstimator sure_of_its_feet() {
  CameraExtrinsicsEstimator::Params params;
  params.prior.toe_sigma_m = 1e-5;
  return {params, base_T_camera()};
}

TEST(CameraExtrinsicsEstimator, TiltedAndRaisedMount_FoundWithinATenthOfADegreeAndAMillimetre) {
  for (const double sign : {1.0, -1.0}) {
    CameraExtrinsicsEstimator mount = estimator();
    Robot robot(sign * 0.7 * kDegree, sign * -0.9 * kDegree, {0.0, 0.0, sign * 0.003});
    for (int i = 0; i < 300; ++i) {
      robot.see(0.0, 0.0, 0.003);
      robot.see(0.15, 0.0, 0.003);
      robot.deliver(mount);
    }
    EXPECT_NEAR(mount.roll_rad(), sign * 0.7 * kDegree, 0.1 * kDegree);
    EXPECT_NEAR(mount.pitch_rad(), sign * -0.9 * kDegree, 0.1 * kDegree);
    EXPECT_NEAR(mount.height_m(), sign * 0.003, 0.001);
    // A point of the ground, seen through the mount that was found.
    const Transform nominal = base_T_camera();
    const Transform truth{rotation_y(sign * -0.9 * kDegree) * rotation_x(sign * 0.7 * kDegree) * nominal.R,
                          nominal.p_m + Vec3{0, 0, sign * 0.003}};
    const Vec3 base_p{0.5, 0.1, -0.79};
    EXPECT_LT((mount.base_T_camera() * (truth.inverse() * base_p) - base_p).norm(), 0.002);
    EXPECT_LT(mount.tilt_sigma_rad(), 0.2 * kDegree);
  }
}

TEST(CameraExtrinsicsEstimator, OneSecond_FindsMost_OneFrame_Little) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 1.0 * kDegree, Vec3::Zero());
  robot.see(0.0);
  robot.deliver(mount);
  EXPECT_LT(mount.pitch_rad(), 0.35 * kDegree);
  for (int i = 0; i < 30; ++i) {
    robot.see(0.0);
    robot.deliver(mount);
  }
  EXPECT_GT(mount.pitch_rad(), 0.85 * kDegree);
}

// Squared error of roll and pitch over the claimed variance, mean of many robots: 1 is honest. Soles are as level as
// three encoders in pitch and two in roll make them; gravity is, and the surface is seen, as much off in every frame.
struct Level {
  double seen_rad = 0.001;  // of the surface, claimed too
  bool soles_stand = true;
  int frames = 300;
};
double squares_over_variance(const Level& level) {
  constexpr int kRobots = 200;
  constexpr double kEncoder_rad = 0.002, kGravity_rad = 0.006;
  const double prior_rad = CameraExtrinsicsEstimator::Params{}.prior.tilt_sigma_rad;
  std::mt19937 random(1);
  std::normal_distribution<> normal;
  std::uniform_real_distribution<> data_sheet(-std::sqrt(3.0) * prior_rad, std::sqrt(3.0) * prior_rad);
  double squares = 0.0;
  for (int i = 0; i < kRobots; ++i) {
    CameraExtrinsicsEstimator mount = estimator();
    const double roll_rad = data_sheet(random), pitch_rad = data_sheet(random);
    const double seen_rad = level.seen_rad * normal(random);
    Robot robot(roll_rad, pitch_rad, Vec3::Zero());
    robot.stance().base_up =
        rotation_y(kGravity_rad * normal(random)) * rotation_x(kGravity_rad * normal(random)) * Vec3::UnitZ();
    robot.stance().stands.fill(level.soles_stand);
    for (Transform& sole : robot.stance().base_T_sole) {
      sole.R = rotation_y(std::sqrt(3.0) * kEncoder_rad * normal(random)) *
               rotation_x(std::sqrt(2.0) * kEncoder_rad * normal(random));
    }
    for (int frame = 0; frame < level.frames; ++frame) {
      robot.see(0.0, seen_rad, 0.001);
      robot.last().tilt_sigma_rad = level.seen_rad;
      robot.deliver(mount);
    }
    const Vec2 error_rad{mount.roll_rad() - roll_rad, mount.pitch_rad() - pitch_rad};
    squares += 0.5 * error_rad.squaredNorm() / math::square(mount.tilt_sigma_rad());
  }
  return squares / kRobots;
}

TEST(CameraExtrinsicsEstimator, ManyRobots_SigmaIsHonestAfterHalfASecondAndAfterTen) {
  for (const int frames : {15, 300}) {
    EXPECT_GT(squares_over_variance({.frames = frames}), 0.6) << frames;
    EXPECT_LT(squares_over_variance({.frames = frames}), 1.2) << frames;
  }
}

// Of narrow treads only, and where no sole stood flat, the mount is known less well, and says so. (The surface is seen
// off in pitch alone, the sigma is of both.)
TEST(CameraExtrinsicsEstimator, OnlyTreadsOrOnlyGravity_SigmaIsHonest) {
  const double treads = squares_over_variance({.seen_rad = 0.0045}),
               gravity = squares_over_variance({.soles_stand = false});
  EXPECT_GT(treads, 0.4);
  EXPECT_LT(treads, 1.2);
  EXPECT_GT(gravity, 0.4);  // gravity's error counts twice, as the surface's slope, too
  EXPECT_LT(gravity, 1.2);
}

// A floor is a better level than a tread 1 m ahead, whose tilt a warped picture shows 8 mrad off in every frame.
TEST(CameraExtrinsicsEstimator, NarrowTreadSeenTilted_FloorDecides) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero());
  for (int i = 0; i < 300; ++i) {
    robot.see(0.0);
    robot.last().tilt_sigma_rad = 0.001;
    for (const double height_m : {0.13, 0.26}) {
      robot.see(height_m, 0.008);
      robot.last().tilt_sigma_rad = 0.0045;
    }
    robot.deliver(mount);
  }
  EXPECT_LT(std::abs(mount.pitch_rad()), 0.0015);
}

// On the stairs nothing but such treads may be in view for longer than the window.
TEST(CameraExtrinsicsEstimator, FloorThenNarrowTreadsForTwentySeconds_FloorIsNotForgotten) {
  CameraExtrinsicsEstimator mount = estimator(), treads_only = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero());
  const auto see_treads = [&](CameraExtrinsicsEstimator& m) {
    robot.see(0.13, 0.008);
    robot.last().tilt_sigma_rad = 0.0045;
    robot.deliver(m);
  };
  for (int i = 0; i < 60; ++i) {
    robot.see(0.0);
    robot.last().tilt_sigma_rad = 0.001;
    robot.deliver(mount);
  }
  for (int i = 0; i < 600; ++i) see_treads(mount);
  for (int i = 0; i < 600; ++i) see_treads(treads_only);
  EXPECT_LT(std::abs(mount.pitch_rad()), 0.002);
  EXPECT_GT(std::abs(treads_only.pitch_rad()), 0.007);  // where they are all there is, they count
}

// Treads of a flight slope each by itself, and a large one or a landing is seen well. The floor that the soles stand on
// is as level as they are.
TEST(CameraExtrinsicsEstimator, SlopingTreadsAhead_WellSeen_DoNotTiltTheCamera) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 1.0 * kDegree, Vec3::Zero());
  for (int i = 0; i < 90; ++i) {
    robot.see(0.0);
    robot.see(0.15, 1.5 * kDegree);
    robot.deliver(mount);
  }
  EXPECT_NEAR(mount.pitch_rad(), 1.0 * kDegree, 0.1 * kDegree);
  for (int i = 0; i < 300; ++i) {
    robot.see(0.15, 1.5 * kDegree);
    robot.deliver(mount);
  }
  EXPECT_NEAR(mount.pitch_rad(), 1.0 * kDegree, 0.1 * kDegree);
}

// One foot a tread: the front one is seen, and is as level as the front foot, not as both in the mean.
TEST(CameraExtrinsicsEstimator, SolesOnTreadsThatSlopeApart_EachTreadIsParallelToItsOwn) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 1.0 * kDegree, Vec3::Zero());
  const double slope_rad = 1.5 * kDegree;
  robot.stance().base_T_sole[0].p_m += Vec3{0.4, 0.0, 0.15};
  robot.stance().base_T_sole[0].R = rotation_y(-slope_rad);
  robot.stance().base_T_sole[1].R = rotation_y(slope_rad);
  for (int i = 0; i < 300; ++i) {
    robot.see(0.15, slope_rad);
    robot.deliver(mount);
  }
  EXPECT_NEAR(mount.pitch_rad(), 1.0 * kDegree, 0.1 * kDegree);
}

// What the soles told is not forgotten for treads that gravity alone says to be level.
TEST(CameraExtrinsicsEstimator, FloorThenSlopingTreadsWithoutASole_FloorIsNotForgotten) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero());
  for (int i = 0; i < 90; ++i) {
    robot.see(0.0);
    robot.last().tilt_sigma_rad = 0.001;
    robot.deliver(mount);
  }
  robot.stance().stands = {false, false};
  for (int i = 0; i < 300; ++i) {
    robot.see(0.15, 1.5 * kDegree);
    robot.last().tilt_sigma_rad = 0.001;
    robot.deliver(mount);
  }
  EXPECT_LT(std::abs(mount.pitch_rad()), 0.1 * kDegree);
}

TEST(CameraExtrinsicsEstimator, OneBadFrame_MovesItByLittle) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero());
  for (int i = 0; i < 150; ++i) {
    robot.see(0.0);
    robot.deliver(mount);
  }
  robot.see(0.015, 2.5 * kDegree);
  robot.deliver(mount);
  EXPECT_LT(std::abs(mount.pitch_rad()), 0.03 * kDegree);
  EXPECT_LT(std::abs(mount.height_m()), 2e-4);
}

TEST(CameraExtrinsicsEstimator, RampAhead_IsNoLevelSurface_AndAFlatOnePullsNoFartherThanTheBounds) {
  CameraExtrinsicsEstimator steep = estimator(), flat = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero()), other(0.0, 0.0, Vec3::Zero());
  for (int i = 0; i < 3000; ++i) {
    robot.see(0.0, 6.0 * kDegree);
    robot.deliver(steep);
    other.see(0.0, 2.9 * kDegree);
    other.deliver(flat);
  }
  EXPECT_EQ(steep.pitch_rad(), 0.0);
  EXPECT_EQ(steep.counters().rejected_surfaces, 3000U);
  EXPECT_LE(std::abs(flat.pitch_rad()), 2.0 * kDegree);
  EXPECT_LE(std::abs(flat.height_m()), 0.008);
}

TEST(CameraExtrinsicsEstimator, GravityOffByHalfADegree_SolesSayWhatIsLevel) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero());
  robot.stance().base_up = rotation_y(0.5 * kDegree) * Vec3::UnitZ();
  for (int i = 0; i < 300; ++i) {
    robot.see(0.0);
    robot.deliver(mount);
  }
  EXPECT_LT(std::abs(mount.pitch_rad()), 0.01 * kDegree);
  // No foot was flat on the ground: gravity says.
  CameraExtrinsicsEstimator by_gravity = estimator();
  robot.stance().stands = {false, false};
  for (int i = 0; i < 300; ++i) {
    robot.see(0.0);
    robot.deliver(by_gravity);
  }
  EXPECT_NEAR(by_gravity.pitch_rad(), 0.5 * kDegree, 0.02 * kDegree);
}

TEST(CameraExtrinsicsEstimator, CameraAheadOfItsPlace_FoundByTheToes) {
  for (const double off_m : {-0.004, 0.004}) {
    CameraExtrinsicsEstimator mount = sure_of_its_feet();
    Robot robot(0.0, 0.0, {off_m, 0.0, 0.0});
    for (int i = 0; i < 30; ++i) {
      robot.see(0.0);
      robot.detect_toe(mount, 0, 0.001);
      robot.deliver(mount);
    }
    EXPECT_NEAR(mount.x_m(), off_m, 0.0006);
    EXPECT_NEAR(mount.base_T_camera().p_m.x() - base_T_camera().p_m.x(), mount.x_m(), 1e-9);
    EXPECT_EQ(mount.counters().toes, 30U);
    // Frames in which no surface is seen tell of the toes all the same.
    CameraExtrinsicsEstimator blind = sure_of_its_feet();
    for (int i = 0; i < 30; ++i) {
      robot.detect_toe(blind, 1, 0.001);
      robot.deliver(blind);
    }
    EXPECT_NEAR(blind.x_m(), off_m, 0.0006);
  }
}

TEST(CameraExtrinsicsEstimator, ToeSeenFarOffOrWhileTheBaseMoves_MovesTheCameraNoFartherThanTheBoundsOrLittle) {
  CameraExtrinsicsEstimator far = sure_of_its_feet(), moving = sure_of_its_feet();
  Robot robot(0.0, 0.0, {0.05, 0.0, 0.0}), other(0.0, 0.0, {0.004, 0.0, 0.0});
  for (int i = 0; i < 300; ++i) {
    robot.detect_toe(far, 0);
    robot.deliver(far);
  }
  EXPECT_NEAR(far.x_m(), 0.010, 1e-9);
  for (int i = 0; i < 150; ++i) {  // before its tilt is known a toe decides alone
    other.see(0.0);
    other.deliver(moving);
  }
  other.stance().speed_mps = 0.3;
  for (int i = 0; i < 10; ++i) {
    other.detect_toe(moving, 0);
    other.deliver(moving);
  }
  EXPECT_LT(std::abs(moving.x_m()), 0.0025);  // the mount is 5 mm vague at the height of the feet
}

// What both toes say may be the camera or the feet: the camera gets its share by what is known of either.
TEST(CameraExtrinsicsEstimator, ToesOfUnknownLength_CameraGetsItsShare) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, {0.004, 0.0, 0.0});
  for (int i = 0; i < 300; ++i) {
    robot.see(0.0);
    for (std::size_t foot = 0; foot < kFootCount; ++foot) robot.detect_toe(mount, foot);
    robot.deliver(mount);
  }
  const CameraExtrinsicsEstimator::PriorParams prior;
  const double mount_m2 = math::square(prior.x_sigma_m) + math::square(kToesBelow_m * mount.tilt_sigma_rad());
  const double share = mount_m2 / (mount_m2 + math::square(prior.toe_sigma_m));
  EXPECT_GT(share, 0.5);
  EXPECT_LT(share, 0.9);
  EXPECT_NEAR(mount.x_m(), share * 0.004, 1e-4);
}

TEST(CameraExtrinsicsEstimator, ToesApart_TellWhichFootStandsAheadAndLeaveTheCamera) {
  CameraExtrinsicsEstimator mount = estimator(), one_foot = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero());
  for (int i = 0; i < 300; ++i) {
    robot.detect_toe(mount, 0, 0.0, 0.003);
    robot.detect_toe(mount, 1, 0.0, -0.003);
    robot.deliver(mount);
    robot.detect_toe(one_foot, 1, 0.0, -0.003);
    robot.deliver(one_foot);
  }
  EXPECT_NEAR(mount.feet_ahead_m()[0], 0.003, 2e-4);
  EXPECT_NEAR(mount.feet_ahead_m()[1], -0.003, 2e-4);
  EXPECT_NEAR(mount.x_m(), 0.0, 2e-4);
  // Of one foot alone nobody knows whether it is ahead of the other.
  EXPECT_LT(std::abs(one_foot.feet_ahead_m()[1]), 0.0005);
}

// A toe that was seen long ago stays where it was seen when the tilt is learnt anew.
TEST(CameraExtrinsicsEstimator, TiltLearntAfterTheToes_TheirPlaceIsKept) {
  CameraExtrinsicsEstimator mount = sure_of_its_feet();
  const double pitch_rad = 0.4 * kDegree;
  Robot robot(0.0, pitch_rad, {0.002, 0.0, 0.0});
  for (int i = 0; i < 60; ++i) {  // before any surface tells of the tilt
    for (std::size_t foot = 0; foot < kFootCount; ++foot) robot.detect_toe(mount, foot);
    robot.deliver(mount);
  }
  EXPECT_EQ(mount.pitch_rad(), 0.0);
  for (int i = 0; i < 300; ++i) {
    robot.see(0.0);
    robot.deliver(mount);
  }
  EXPECT_NEAR(mount.pitch_rad(), pitch_rad, 0.1 * pitch_rad);
  // What is left of the pitch, and what a bearing that is not straight down adds.
  EXPECT_NEAR(mount.x_m(), 0.002, kToesBelow_m * std::abs(mount.pitch_rad() - pitch_rad) + 2e-4);
}

// One foot stands a rise higher: the tilt, learnt later, changes the place by the height above each toe.
TEST(CameraExtrinsicsEstimator, TiltLearntAfterToesOnTwoSteps_LegsAreNotApart) {
  CameraExtrinsicsEstimator mount = sure_of_its_feet();
  Robot robot(0.0, 0.4 * kDegree, Vec3::Zero());
  robot.stance().base_T_sole[0].p_m.z() += 0.17;
  for (int i = 0; i < 60; ++i) {
    for (std::size_t foot = 0; foot < kFootCount; ++foot) robot.detect_toe(mount, foot);
    robot.deliver(mount);
  }
  EXPECT_GT(std::abs(mount.feet_ahead_m()[0]), 0.0003);  // the pitch, not known yet, is taken for the legs
  robot.stance().base_T_sole[0].p_m.z() -= 0.17;
  for (int i = 0; i < 600; ++i) {
    robot.see(0.0);
    robot.deliver(mount);
  }
  EXPECT_NEAR(mount.feet_ahead_m()[0], 0.0, 1e-4);
}

// What both would have shown since is not told by the one that is still seen.
TEST(CameraExtrinsicsEstimator, OneToeHiddenWhileTheOtherMoves_LegsAreNotApartForLong) {
  CameraExtrinsicsEstimator mount = sure_of_its_feet();
  Robot before(0.0, 0.0, Vec3::Zero());
  const auto see = [&](Robot& robot, int frames, std::size_t feet) {
    for (int i = 0; i < frames; ++i) {
      robot.see(0.0);
      for (std::size_t foot = 0; foot < feet; ++foot)
        robot.detect_toe(mount, foot, 0.0, &robot == &before ? 0.0 : 0.003);
      robot.deliver(mount);
    }
  };
  see(before, 300, 2);
  Robot after = before;
  see(after, 30, 1);
  EXPECT_LT(std::abs(mount.feet_ahead_m()[0]), 0.0016);
  see(after, 3000, 1);
  EXPECT_LT(std::abs(mount.feet_ahead_m()[0]), 0.0004);
}

TEST(CameraExtrinsicsEstimator, ToesFarApart_LegsAreBelievedApartByThreeSigmas) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, Vec3::Zero());
  for (int i = 0; i < 300; ++i) {
    robot.detect_toe(mount, 0, 0.0, 0.010);
    robot.detect_toe(mount, 1, 0.0, -0.010);
    robot.deliver(mount);
  }
  EXPECT_NEAR(mount.feet_ahead_m()[0], 1.5 * CameraExtrinsicsEstimator::PriorParams{}.legs_apart_sigma_m, 1e-9);
}

TEST(CameraExtrinsicsEstimator, ToeOfAFootInTheAirOrNoNumber_TellsNothing) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, {0.004, 0.0, 0.0});
  robot.stance().stands = {false, true};
  for (int i = 0; i < 30; ++i) {
    robot.detect_toe(mount, 0);
    robot.stance().toes[1] = ToeSighting{std::numeric_limits<double>::quiet_NaN(), 0.0006};
    robot.deliver(mount);
  }
  EXPECT_EQ(mount.x_m(), 0.0);
  EXPECT_EQ(mount.counters().toes, 0U);
}

TEST(CameraExtrinsicsEstimator, NoStandingSole_LeavesTheHeight_NextStepIsNotTheSolesOwn) {
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 0.0, {0.0, 0.0, 0.003});
  for (int i = 0; i < 60; ++i) {
    robot.see(0.04);  // a step of 40 mm
    robot.deliver(mount);
  }
  robot.stance().stands = {false, false};
  for (int i = 0; i < 60; ++i) {
    robot.see(0.0);
    robot.deliver(mount);
  }
  EXPECT_EQ(mount.height_m(), 0.0);
  EXPECT_EQ(mount.counters().heights, 0U);
}

TEST(CameraExtrinsicsEstimator, NumbersThatAreNone_AreCountedAndChangeNothing) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CameraExtrinsicsEstimator mount = estimator();
  Robot robot(0.0, 1.0 * kDegree, Vec3::Zero());
  robot.see(0.0);
  robot.last().normal.x() = kNan;
  robot.see(0.0);
  robot.last().d_m = kNan;
  robot.deliver(mount);
  EXPECT_EQ(mount.counters().rejected_surfaces, 2U);
  robot.see(0.0);
  robot.stance().base_up.z() = kNan;
  robot.deliver(mount);
  robot.stance().base_up = Vec3::UnitZ();
  robot.stance().base_T_sole[1].p_m.x() = kNan;
  robot.see(0.0);
  robot.deliver(mount);
  EXPECT_EQ(mount.counters().rejected_frames, 2U);
  EXPECT_EQ(mount.pitch_rad(), 0.0);
  EXPECT_EQ((mount.base_T_camera().R - base_T_camera().R).norm(), 0.0);
}

}  // namespace
}  // namespace polygmap
