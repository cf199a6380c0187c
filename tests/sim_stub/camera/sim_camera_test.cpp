// SPDX-License-Identifier: Apache-2.0
// The simulated depth camera: geometry against an independent ray marcher, noise against its model, timing and faults.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim_stub/robot_camera.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

constexpr int kWidth = kDepthWidth_px, kHeight = kDepthHeight_px;

DepthScene scene_at(const Transform& true_T_base, std::span<const SolidBox> solids, const JointVector& q_rad) {
  return {true_T_base * base_T_camera(),
          solids,
          {base_leg_shapes({}, Foot::kLeft, leg_joints(q_rad, Foot::kLeft)),
           base_leg_shapes({}, Foot::kRight, leg_joints(q_rad, Foot::kRight))},
          base_T_camera(),
          true};
}

JointVector bent_q_rad(double left_lift_m, double left_forward_m) {
  JointVector q;
  q.head<6>() = solve_leg({}, Foot::kLeft, {Mat3::Identity(), Vec3{left_forward_m, 0.1, -0.79 + left_lift_m}}).q_rad;
  q.tail<6>() = solve_leg({}, Foot::kRight, {Mat3::Identity(), Vec3{0, -0.1, -0.79}}).q_rad;
  return q;
}

Vec3 ray_of(int u, int v) {
  const CameraIntrinsics k = robot_camera_intrinsics();
  return {(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, 1.0};
}

// Depth by marching along the ray with the distance to everything: shares nothing with the renderer. 0 beyond 6 m.
double marched_depth_m(const DepthScene& scene, int u, int v) {
  const Vec3 camera_ray = ray_of(u, v);
  const Vec3 direction = (scene.true_T_camera.R * camera_ray).normalized();
  const Transform base_T_true = scene.base_T_camera * scene.true_T_camera.inverse();
  double along_m = 0.0;
  for (int i = 0; i < 400 && along_m < 12.0; ++i) {
    const Vec3 p = scene.true_T_camera.p_m + along_m * direction;
    double distance_m = p.z();
    for (const SolidBox& s : scene.solids) {
      const Vec3 along = s.true_T_solid.inverse() * p;
      const Vec3 out = (s.min_m - along).cwiseMax(along - s.max_m);
      distance_m = std::min(distance_m, out.cwiseMax(0.0).norm() + std::min(out.maxCoeff(), 0.0) - s.round_m);
    }
    if (scene.legs_visible) {
      const Vec3 base_p = base_T_true * p;
      for (const LegShapes& leg : scene.base_legs) {
        distance_m = std::min({distance_m, signed_distance_m(leg.thigh, base_p), signed_distance_m(leg.shank, base_p),
                               polygmap::signed_distance_m(leg.foot, base_p)});
      }
    }
    along_m += distance_m;
    if (distance_m < 1e-6) break;
  }
  const double z_m = along_m / camera_ray.norm();
  return z_m < 6.0 ? z_m : 0.0;
}

double depth_m(const DepthRenderer& renderer, int u, int v) {
  const float inverse = renderer.inverse_depth(v)[u];
  return inverse > 1.0F / 6.0F ? 1.0 / static_cast<double>(inverse) : 0.0;
}

void compare_with_a_ray_marcher(const StairErrors& errors) {
  const StairWorld world = make_stairs({.steps = 5, .nosing_m = 0.02}, 2, errors);
  const std::vector<SolidBox> solids = solids_of(world);
  struct Pose {
    Vec3 p_m;
    double yaw, pitch, roll, lift, forward;
  };
  const std::array<Pose, 5> poses{{{{-0.5, 0.1, 0.79}, 0.17, 0, 0, 0, 0},
                                   {{0.1, 0, 0.92}, 0.05, 0.03, -0.02, 0.19, 0.15},
                                   {{0.66, -0.1, 1.15}, -0.1, -0.05, 0.02, 0.05, 0.28},
                                   {{0.3, 0.75, 0.9}, -0.4, 0.1, 0.1, 0.0, 0.0},    // beside the stairs
                                   {{1.4, 0.0, 1.45}, 0.0, -0.2, 0.0, 0.1, 0.0}}};  // looking across the landing
  DepthRenderer renderer(robot_camera_intrinsics());
  for (const Pose& pose : poses) {
    const Transform true_T_base{rotation_z(pose.yaw) * rotation_y(pose.pitch) * rotation_x(pose.roll), pose.p_m};
    const DepthScene scene = scene_at(true_T_base, solids, bent_q_rad(pose.lift, pose.forward));
    renderer.render(scene);
    int compared = 0, differ = 0;
    for (int v = 3; v < kHeight; v += 9) {
      for (int u = 2; u < kWidth; u += 7) {
        ++compared;
        differ += std::abs(depth_m(renderer, u, v) - marched_depth_m(scene, u, v)) > 2e-4 ? 1 : 0;
      }
    }
    EXPECT_LE(differ, compared / 1000) << pose.p_m.transpose();  // silhouettes that graze a pixel centre
  }
}

TEST(DepthRenderer, SeveralPoses_AgreeWithARayMarcher) { compare_with_a_ray_marcher({}); }

TEST(DepthRenderer, TreadsThatSlopeAndTurnAndAreWorn_AgreeWithARayMarcher) {
  compare_with_a_ray_marcher(
      {.tread_slope_rad = 0.05, .tread_cant_rad = 0.05, .tread_yaw_rad = 0.1, .worn_nosing_m = 0.012});
}

TEST(DepthRenderer, MovingWhileItScans_EveryRowIsAsSeenFromItsOwnMoment) {
  const StairWorld world = make_stairs({.steps = 5, .nosing_m = 0.02}, 2);
  const std::vector<SolidBox> solids = solids_of(world);
  // 1 m/s and half a radian per second for 16 ms, a leg swinging.
  const auto scene = [&](double s) {
    const Mat3 turn = rotation_z(0.1 + 0.006 * s) * rotation_y(0.03 - 0.008 * s) * rotation_x(0.005 * s);
    return scene_at({turn, Vec3{0.1 + 0.016 * s, 0.0, 0.92}}, solids, bent_q_rad(0.15 + 0.01 * s, 0.1 + 0.016 * s));
  };
  DepthRenderer renderer(robot_camera_intrinsics());
  renderer.render(scene(0.0), scene(1.0));
  int compared = 0, differ = 0, as_in_the_middle = 0;
  const DepthScene middle = scene(0.5);
  for (int v = 3; v < kHeight; v += 9) {
    const DepthScene then = scene((v + 0.5) / kHeight);
    for (int u = 2; u < kWidth; u += 7) {
      ++compared;
      differ += std::abs(depth_m(renderer, u, v) - marched_depth_m(then, u, v)) > 4e-4 ? 1 : 0;
      as_in_the_middle += std::abs(depth_m(renderer, u, v) - marched_depth_m(middle, u, v)) < 4e-4 ? 1 : 0;
    }
  }
  EXPECT_LE(differ, compared / 500);
  EXPECT_LT(as_in_the_middle, compared / 2);
}

TEST(DepthRenderer, IncidenceCosine_EverySurface_IsTheAngleToItsNormal) {
  const StairWorld world = make_stairs({}, 1);
  const std::vector<SolidBox> solids = solids_of(world);
  DepthRenderer renderer(robot_camera_intrinsics());
  renderer.render(scene_at({rotation_z(0.2), Vec3{-0.3, 0, 0.79}}, solids, bent_q_rad(0.1, 0.1)));
  const auto point = [&](int u, int v) { return Vec3(depth_m(renderer, u, v) * ray_of(u, v)); };
  int compared = 0;
  for (int v = 2; v + 2 < kHeight; v += 5) {
    for (int u = 2; u + 2 < kWidth; u += 5) {
      const Vec3 here = point(u, v);
      const Vec3 across = point(u + 1, v) - point(u - 1, v), down = point(u, v + 1) - point(u, v - 1);
      const Vec3 bend = point(u + 1, v) + point(u - 1, v) + point(u, v + 1) + point(u, v - 1) - 4.0 * here;
      if (here.z() == 0.0 || bend.norm() > 2e-4) continue;  // an edge
      const double expected = std::abs(across.cross(down).normalized().dot(here.normalized()));
      const auto cosine = static_cast<double>(renderer.inverse_depth(v)[u] * renderer.plane_distance(v)[u] *
                                              renderer.inverse_length(v)[u]);
      ++compared;
      ASSERT_NEAR(cosine, expected, 0.02) << u << " " << v;
    }
  }
  EXPECT_GT(compared, 8000);
}

TEST(DepthRenderer, RaisedKnee_ShowsWhereItProjects) {
  const StairWorld world = make_stairs({}, 1);
  const std::vector<SolidBox> solids = solids_of(world);
  DepthRenderer renderer(robot_camera_intrinsics());
  DepthScene scene = scene_at({Mat3::Identity(), Vec3{0.1, 0, 0.92}}, solids, bent_q_rad(0.2, 0.1));
  const Vec3 knee = base_T_camera().inverse() * scene.base_legs[0].thigh.b_m;
  const CameraIntrinsics k = robot_camera_intrinsics();
  const int u = static_cast<int>(std::lround(k.cx_px + k.fx_px * knee.x() / knee.z()));
  const int v = static_cast<int>(std::lround(k.cy_px + k.fy_px * knee.y() / knee.z()));
  ASSERT_TRUE(u >= 0 && u < kWidth && v >= 0 && v < kHeight);
  renderer.render(scene);
  EXPECT_LT(depth_m(renderer, u, v), knee.z() - 0.7 * kThighRadius_m);  // its front, or the thigh's
  EXPECT_GT(depth_m(renderer, u, v), knee.z() - 2.0 * kThighRadius_m);
  scene.legs_visible = false;
  renderer.render(scene);
  EXPECT_GT(depth_m(renderer, u, v), knee.z() + 0.1);
}

// A level floor seen by a still camera: what the noise adds.
class NoiseOnFloor {
 public:
  explicit NoiseOnFloor(const CameraNoise::Params& params, std::uint64_t seed = 3)
      : renderer_(robot_camera_intrinsics()),
        noise_(params, robot_camera_intrinsics(), seed),
        depth_(kWidth * kHeight) {
    DepthScene scene = scene_at({Mat3::Identity(), Vec3{0, 0, 0.79}}, {}, bent_q_rad(0, 0));
    scene.legs_visible = false;
    renderer_.render(scene);
  }
  void expose(int frame) { noise_.apply(renderer_, static_cast<std::uint64_t>(frame), frame / 30.0, depth_.data()); }
  [[nodiscard]] bool valid(int u, int v) const { return raw(u, v) != 0; }
  [[nodiscard]] double error_mm(int u, int v) const { return 0.25 * raw(u, v) - 1e3 * depth_m(renderer_, u, v); }
  [[nodiscard]] double depth(int u, int v) const { return depth_m(renderer_, u, v); }
  [[nodiscard]] double cosine(int u, int v) const { return -(base_T_camera().R * ray_of(u, v).normalized()).z(); }
  [[nodiscard]] double sigma_mm(int u, int v) const {
    return (1.0 + 1.5 * depth(u, v)) / std::max(cosine(u, v), std::cos(75.0 * kPi / 180.0));
  }

 private:
  [[nodiscard]] int raw(int u, int v) const { return depth_[static_cast<std::size_t>(v * kWidth + u)]; }
  DepthRenderer renderer_;
  CameraNoise noise_;
  std::vector<std::uint16_t> depth_;
};

struct NoiseFigures {
  double mean = 0, sigma = 0, next = 0, far = 0, dropout = 0, dropout_pairs = 0, frame_to_frame = 0;
};
// In units of sigma, over frames 0-9 and the rows where the floor is within 2 m.
NoiseFigures measure(NoiseOnFloor& floor) {
  NoiseFigures f;
  int valid = 0, pairs = 0, far_pairs = 0, dropped = 0, dropped_pairs = 0, repeated = 0;
  std::vector<double> last(kWidth * kHeight, std::numeric_limits<double>::quiet_NaN());
  for (int frame = 0; frame < 10; ++frame) {
    floor.expose(frame);
    for (int v = 100; v < kHeight; v += 3) {
      double left = std::numeric_limits<double>::quiet_NaN(), far_left = left;
      bool left_dropped = false;
      for (int u = 0; u < kWidth; ++u) {
        const bool ok = floor.valid(u, v);
        const double x = ok ? floor.error_mm(u, v) / floor.sigma_mm(u, v) : std::numeric_limits<double>::quiet_NaN();
        dropped += ok ? 0 : 1;
        dropped_pairs += !ok && left_dropped ? 1 : 0;
        left_dropped = !ok;
        if (u % 20 == 10) far_left = x;
        if (ok) {
          f.mean += x;
          f.sigma += x * x;
          ++valid;
          if (!std::isnan(left)) {
            f.next += x * left;
            ++pairs;
          }
          if (u % 20 == 5 && !std::isnan(far_left)) {  // 15 columns apart
            f.far += x * far_left;
            ++far_pairs;
          }
          double& before = last[static_cast<std::size_t>(v * kWidth + u)];
          if (!std::isnan(before)) {
            f.frame_to_frame += x * before;
            ++repeated;
          }
          before = x;
        }
        left = x;
      }
    }
  }
  f.mean /= valid;
  f.sigma = std::sqrt(f.sigma / valid);
  f.next /= pairs * f.sigma * f.sigma;
  f.far /= far_pairs * f.sigma * f.sigma;
  f.frame_to_frame /= repeated * f.sigma * f.sigma;
  f.dropout = static_cast<double>(dropped) / (valid + dropped);
  f.dropout_pairs = static_cast<double>(dropped_pairs) / dropped;
  return f;
}

TEST(DepthNoise, White_OnFloor_HasItsSigmaAndNoCorrelation) {
  NoiseOnFloor floor({});
  const NoiseFigures f = measure(floor);
  EXPECT_NEAR(f.mean, 0.0, 0.01);
  EXPECT_NEAR(f.sigma, 1.0, 0.01);
  EXPECT_NEAR(f.next, 0.0, 0.01);
  EXPECT_NEAR(f.frame_to_frame, 0.0, 0.01);
  EXPECT_NEAR(f.dropout, 0.05, 0.003);
  EXPECT_NEAR(f.dropout_pairs, 0.05, 0.005);
}

TEST(DepthNoise, StereoOnFloor_GrowsWithTheSquareOfTheRange) {
  NoiseOnFloor floor({.sigma = {.base_m = 0.0005, .per_metre = 0.0, .quadratic_per_m = 0.004}});
  double near = 0, far = 0;
  int near_count = 0, far_count = 0;
  for (int frame = 0; frame < 10; ++frame) {
    floor.expose(frame);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; u += 5) {
        const double z_m = floor.depth(u, v), cosine = floor.cosine(u, v);
        if (!floor.valid(u, v) || cosine < 0.3) continue;
        const double off = floor.error_mm(u, v) * cosine / (0.5 + 4.0 * z_m * z_m);
        if (z_m < 1.0) near += off * off, ++near_count;
        if (z_m > 1.1) far += off * off, ++far_count;
      }
    }
  }
  ASSERT_GT(near_count, 1000);
  ASSERT_GT(far_count, 1000);
  EXPECT_NEAR(std::sqrt(near / near_count), 1.0, 0.03);
  EXPECT_NEAR(std::sqrt(far / far_count), 1.0, 0.03);
}

TEST(DepthNoise, Correlated_OnFloor_HasItsSigmaAndItsSharesCorrelationAndBlobs) {
  for (const double share : {DepthNoiseModel{}.correlated_share, 0.3, 1.0}) {
    NoiseOnFloor floor({.kind = NoiseKind::kCorrelated, .sigma = {.correlated_share = share}, .warp_m = 0.0});
    const NoiseFigures f = measure(floor);
    EXPECT_NEAR(f.mean, 0.0, 0.05);
    EXPECT_NEAR(f.sigma, 1.0, 0.03);
    EXPECT_NEAR(f.next, std::min(share, 8.0 / 9.0), 0.03);
    EXPECT_NEAR(f.far, 0.0, 0.05);
    EXPECT_NEAR(f.frame_to_frame, 0.0, 0.05);
    EXPECT_NEAR(f.dropout, 0.05, 0.01);
    EXPECT_GT(f.dropout_pairs, 0.4);
  }
}

TEST(DepthNoise, Warp_OverTwentySeconds_IsHalfFixedAndHalfRedrawn) {
  NoiseOnFloor floor({.kind = NoiseKind::kCorrelated}), still({.kind = NoiseKind::kCorrelated, .warp_m = 0.0});
  // The same frame with and without warp: their difference is the warp alone.
  std::vector<Vec2> places;
  for (int v = 40; v < kHeight; v += 80) {
    for (int u = 40; u < kWidth; u += 80) places.emplace_back(u, v);
  }
  constexpr int kFrames = 200;
  std::vector<std::vector<double>> warp(places.size());
  double neighbours = 0, squares = 0;
  int count = 0;
  for (int frame = 0; frame < 3 * kFrames; frame += 3) {
    floor.expose(frame);
    still.expose(frame);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const int u = static_cast<int>(places[i].x()), v = static_cast<int>(places[i].y());
      const bool ok = floor.valid(u, v) && floor.valid(u + 8, v);
      const double w = ok ? floor.error_mm(u, v) - still.error_mm(u, v) : 0.0;
      warp[i].push_back(w);
      if (!ok) continue;
      neighbours += w * (floor.error_mm(u + 8, v) - still.error_mm(u + 8, v));
      squares += w * w;
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(squares / count), 2.0, 0.3);
  EXPECT_GT(neighbours / squares, 0.8);  // smooth over 8 columns
  double fixed2 = 0, lagged = 0, moving2 = 0;
  for (const std::vector<double>& series : warp) {
    double mean = 0;
    for (const double w : series) mean += w / kFrames;
    fixed2 += mean * mean / static_cast<double>(warp.size());
    for (std::size_t i = 0; i + 5 < series.size(); ++i) {  // 0.5 s apart
      lagged += (series[i] - mean) * (series[i + 5] - mean);
      moving2 += math::square(series[i] - mean);
    }
  }
  EXPECT_NEAR(std::sqrt(fixed2), 1.41, 0.3);
  EXPECT_NEAR(lagged / moving2, 1.0 / kPi, 0.15);
}

TEST(DepthNoise, Scale_StretchesEveryDepth) {
  NoiseOnFloor floor({.scale = 1.003, .strength = 0.0});
  floor.expose(0);
  for (int v = 100; v < kHeight; v += 50) {
    const double z_mm = floor.error_mm(320, v) / 0.003;
    EXPECT_NEAR(z_mm, (0.79 - 0.00702) * 1e3 / -(base_T_camera().R * ray_of(320, v)).z(), 50.0);  // 0.25 mm / 0.003
  }
}

TEST(DepthNoise, Edges_AtADepthJump_GetFlyingPixels) {
  const StairWorld world = make_stairs({.steps = 1, .rise_m = 0.3, .width_m = 0.6, .jitter_m = 0.0}, 1);
  const std::vector<SolidBox> solids = solids_of(world);
  DepthRenderer renderer(robot_camera_intrinsics());
  DepthScene scene = scene_at({Mat3::Identity(), Vec3{0.1, 0.2, 0.9}}, solids, bent_q_rad(0, 0));
  scene.legs_visible = false;
  renderer.render(scene);
  CameraNoise noise({}, robot_camera_intrinsics(), 1);
  std::vector<std::uint16_t> depth(kWidth * kHeight);
  int jumps = 0, flying = 0, elsewhere = 0;
  for (std::uint64_t frame = 0; frame < 10; ++frame) {
    noise.apply(renderer, frame, 0.0, depth.data());
    for (int v = 1; v + 1 < kHeight; ++v) {
      for (int u = 0; u + 1 < kWidth; ++u) {
        const double here = depth_m(renderer, u, v), right = depth_m(renderer, u + 1, v),
                     below = depth_m(renderer, u, v + 1);
        const int raw = depth[static_cast<std::size_t>(v * kWidth + u)];
        if (here == 0.0 || right == 0.0 || raw == 0) continue;
        const bool jump = std::abs(right - here) > 0.1;
        const bool between = std::abs(2.5e-4 * raw - here) > 0.02;
        if (jump && std::abs(below - here) < 0.02) {
          ++jumps;
          flying += between ? 1 : 0;
        } else if (std::abs(right - here) < 0.02 && std::abs(below - here) < 0.02 && here < 2.0) {
          const double cosine = static_cast<double>(renderer.inverse_depth(v)[u] * renderer.plane_distance(v)[u] *
                                                    renderer.inverse_length(v)[u]);
          const double sigma = 1e-3 * (1.0 + 1.5 * here) / std::max(cosine, 0.2588);
          elsewhere += std::abs(2.5e-4 * raw - here) > 6.0 * sigma ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(jumps, 500);
  EXPECT_NEAR(static_cast<double>(flying) / jumps, 0.4 * 0.9, 0.06);  // some mixes stay close to one side
  EXPECT_EQ(elsewhere, 0);
}

SimOptions quiet(std::uint64_t seed) {
  SimOptions options;
  options.seed = seed;
  options.errors = ErrorParams::none();
  options.start = StartPose{0.4, 0.0, 0.0};
  options.stairs.jitter_m = 0.0;
  return options;
}

std::vector<std::uint16_t> first_picture(const SimOptions& options) {
  SimRobot robot(options);
  DepthFrameView frame;
  for (int i = 0; i < 100; ++i) {
    if (robot.try_acquire(frame)) return {frame.depth, frame.depth + kWidth * kHeight};
    robot.advance();
  }
  return {};
}

TEST(SimCamera, Frames_ArriveThirtyMillisecondsAfterTheirExposureAtThirtyHertz) {
  SimOptions options = quiet(1);
  options.camera.silent = {{VirtualClock::kStart_ns + 500 * kNsPerMs, VirtualClock::kStart_ns + 800 * kNsPerMs}};
  SimRobot robot(options);
  DepthFrameView frame;
  int count = 0;
  for (int i = 0; i < 1000; ++i) {
    if (robot.try_acquire(frame)) {
      EXPECT_EQ(robot.now_ns() - frame.stamp_ns, 30 * kNsPerMs);
      EXPECT_NEAR(seconds(frame.stamp_ns - VirtualClock::kStart_ns), frame.sequence / 30.0, 0.00101);
      DepthFrameView second;
      EXPECT_FALSE(robot.try_acquire(second));  // one at a time
      robot.release();
      ++count;
    }
    robot.advance();
  }
  EXPECT_EQ(count, 60 - 9);
  EXPECT_EQ(robot.depth_camera().overwritten(), 0U);
}

TEST(SimCamera, FramesNobodyFetches_AreOverwrittenAndCounted) {
  SimRobot robot(quiet(1));
  for (int i = 0; i < 500; ++i) robot.advance();
  EXPECT_GT(robot.depth_camera().overwritten(), 20U);
  DepthFrameView frame;
  ASSERT_TRUE(robot.try_acquire(frame));
  EXPECT_LT(robot.now_ns() - frame.stamp_ns, 150 * kNsPerMs);
}

TEST(SimCamera, BlankWindow_GivesFramesWithoutAnyDepth) {
  SimOptions options = quiet(1);
  options.camera.blank = {{0, std::numeric_limits<std::int64_t>::max()}};
  const std::vector<std::uint16_t> picture = first_picture(options);
  ASSERT_EQ(picture.size(), static_cast<std::size_t>(kWidth * kHeight));
  EXPECT_EQ(std::count(picture.begin(), picture.end(), 0), kWidth * kHeight);
}

TEST(SimCamera, MountErrors_StayWithinTheirRangesAndMoveThePicture) {
  Vec3 most_rad = Vec3::Zero(), most_m = Vec3::Zero();
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Transform mount = draw_errors({}, seed).base_T_camera, nominal = base_T_camera();
    const Mat3 turn = mount.R * nominal.R.transpose();
    const Vec3 rad{turn(2, 1), turn(0, 2), turn(1, 0)};
    most_rad = most_rad.cwiseMax(rad.cwiseAbs());
    most_m = most_m.cwiseMax((mount.p_m - nominal.p_m).cwiseAbs());
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(most_rad[i], kPi / 180.0, 0.001);
    EXPECT_NEAR(most_m[i], 0.003, 0.0001);
  }
  EXPECT_EQ((draw_errors(ErrorParams::none(), 3).base_T_camera.R - base_T_camera().R).norm(), 0.0);
  SimOptions off = quiet(1);
  off.errors.camera_mount_rad = kPi / 180.0;
  const std::vector<std::uint16_t> a = first_picture(quiet(1)), b = first_picture(off);
  EXPECT_NE(a, b);
}

TEST(SimCamera, ShiftedStairs_LookLikeStairsThere) {
  SimOptions shifted = quiet(1), moved = quiet(1);
  shifted.camera.stairs_shift_m = {0.03, 0.0, 0.0};
  moved.start->distance_m += 0.03;
  shifted.camera.legs_visible = moved.camera.legs_visible = false;
  const std::vector<std::uint16_t> a = first_picture(shifted), b = first_picture(moved), c = first_picture(quiet(1));
  int same = 0, as_before = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    same += std::abs(a[i] - b[i]) <= 1 ? 1 : 0;
    as_before += std::abs(a[i] - c[i]) <= 1 ? 1 : 0;
  }
  EXPECT_GT(same, kWidth * kHeight * 999 / 1000);
  EXPECT_LT(as_before, kWidth * kHeight * 8 / 10);
}

TEST(SimCamera, MissingStep_IsAHoleDownToTheFloor) {
  SimOptions whole = quiet(1), holed = quiet(1);
  holed.camera.missing_step = 0;
  const std::vector<std::uint16_t> a = first_picture(whole), b = first_picture(holed);
  int deeper = 0, nearer = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    deeper += b[i] > a[i] + 100 ? 1 : 0;  // 25 mm
    nearer += b[i] != 0 && b[i] + 1 < a[i] ? 1 : 0;
  }
  EXPECT_GT(deeper, 20000);
  EXPECT_EQ(nearer, 0);
}

TEST(SimCamera, HiddenLegs_LeaveThePicture) {
  SimOptions with = quiet(1), without = quiet(1);
  without.camera.legs_visible = false;
  const std::vector<std::uint16_t> a = first_picture(with), b = first_picture(without);
  int hidden = 0;
  for (std::size_t i = 0; i < a.size(); ++i) hidden += a[i] + 400 < b[i] ? 1 : 0;
  EXPECT_GT(hidden, 10000);
}

std::uint64_t fingerprint(SimOptions options, bool threaded) {
  options.camera.threaded = threaded;
  SimRobot robot(options);
  std::uint64_t hash = 1469598103934665603ULL;
  const auto add = [&hash](const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211ULL;
  };
  for (int i = 0; i < 150; ++i) {
    ImuSample imu;
    while (robot.try_read(imu)) {
      add(imu.gyro_radps.data(), sizeof(double) * 3);
      add(imu.accel_mps2.data(), sizeof(double) * 3);
    }
    JointFeedback joints;
    JointCommand command;
    if (robot.try_read(joints)) {
      add(joints.q_rad.data(), sizeof(double) * kJointCount);
      add(joints.foot_force_n.data(), sizeof(double) * kFootCount);
    }
    for (std::size_t j = 0; j < kJointCount; ++j) command.joints[j].q_rad = joints.q_rad[static_cast<Eigen::Index>(j)];
    EXPECT_TRUE(robot.try_write(command).is_all());
    LioSample lio;
    while (robot.try_read(lio)) add(lio.lio_T_lidar.p_m.data(), sizeof(double) * 3);
    DepthFrameView frame;
    if (robot.try_acquire(frame)) {
      add(frame.depth, sizeof(std::uint16_t) * kWidth * kHeight);
      robot.release();
    }
    add(robot.truth().true_T_base.p_m.data(), sizeof(double) * 3);
    robot.advance();
  }
  return hash;
}

TEST(SimRobot, ScanTime_IsRoundedToTwoTicksAndSaysSo) {
  for (const auto& [asked_ms, simulated_ms] : {std::pair{16.0, 16.0}, {15.0, 16.0}, {9.5, 8.0}, {1.0, 0.0}}) {
    SimOptions options;
    options.camera.scan_s = 1e-3 * asked_ms;
    EXPECT_NEAR(1e3 * SimRobot(options).depth_camera().scan_s(), simulated_ms, 1e-9) << asked_ms;
  }
}

TEST(SimRobot, SameSeed_ThreadedOrNot_IsTheSameToTheLastBit) {
  for (const NoiseKind kind : {NoiseKind::kWhite, NoiseKind::kCorrelated}) {
    SimOptions options;
    options.noise = kind;
    const std::uint64_t once = fingerprint(options, false);
    EXPECT_EQ(once, fingerprint(options, true));
    options.seed = 2;
    EXPECT_NE(once, fingerprint(options, false));
  }
}

}  // namespace
}  // namespace polygmap::sim
