// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/camera/depth_holes.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace polygmap::sim {
namespace {

constexpr int kBlob_px = 6;
constexpr double kBlob_m = 0.03;
constexpr double kOn_m = 0.002;  // so far off a tread's plane a pixel is still of the tread

// A point, or what is linear in it, along a row of pixels.
struct AlongRow {
  Vec3 at, at_zero, per_px;
  [[nodiscard]] Vec3 operator()(int u, double depth_m) const { return at + depth_m * (at_zero + u * per_px); }
  [[nodiscard]] double z(int u, double depth_m) const { return at.z() + depth_m * (at_zero.z() + u * per_px.z()); }
};

// Whether what is seen at that depth is in or behind the box: its numbers along the box's axes.
bool is_behind(const AlongRow& box_p, const Vec3& half_m, int u, double depth_m) {
  double enters_m = 0.0, leaves_m = depth_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double from_m = box_p.at[axis], per_m = box_p.at_zero[axis] + u * box_p.per_px[axis];
    const double a_m = (-half_m[axis] - from_m) / per_m, b_m = (half_m[axis] - from_m) / per_m;
    enters_m = std::max(enters_m, std::min(a_m, b_m));
    leaves_m = std::min(leaves_m, std::max(a_m, b_m));
  }
  return enters_m < leaves_m;
}

double drawn(const CounterNoise& noise, std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return noise.uniform(mix64(mix64(mix64(a + 1) ^ b) ^ c));
}

}  // namespace

// What was drawn last is asked for again by the pixel beside.
class DepthHoles::Draws {
 public:
  Draws(const CameraErrors& errors, const CounterNoise& noise, std::uint64_t frame)
      : errors_(errors), noise_(noise), frame_(frame) {}

  [[nodiscard]] bool is_dark(int u, int v) {
    if (const std::array<int, 2> blob{u / kBlob_px, v / kBlob_px}; blob != blob_) {
      blob_ = blob;
      dark_ = drawn(noise_, frame_, static_cast<std::uint64_t>(blob[0]), static_cast<std::uint64_t>(blob[1])) <
              errors_.dark_share;
    }
    return dark_;
  }
  [[nodiscard]] bool is_shiny(const Vec2& step_p_m) {
    if (errors_.shiny_share <= 0.0) return false;
    constexpr double kInside = 0.499999;
    if (const Vec2 off = step_p_m / kBlob_m - cell_; !(off.cwiseAbs().maxCoeff() < kInside)) {
      cell_ = {std::round(step_p_m.x() / kBlob_m), std::round(step_p_m.y() / kBlob_m)};
      const auto index = [](double along) {
        return static_cast<std::uint64_t>(static_cast<std::int64_t>(along) + 1000);
      };
      constexpr std::uint64_t kAlways = 1ULL << 40U;  // no frame has that number
      shiny_ = drawn(noise_, kAlways, index(cell_.x()), index(cell_.y())) < errors_.shiny_share;
    }
    return shiny_;
  }

 private:
  const CameraErrors& errors_;
  const CounterNoise& noise_;
  std::uint64_t frame_;
  std::array<int, 2> blob_{-1, -1};
  Vec2 cell_ = Vec2::Constant(1e9);
  bool dark_ = false, shiny_ = false;
};

DepthHoles::DepthHoles(const CameraErrors& errors, const StairWorld& world, std::uint64_t seed)
    : errors_(errors), noise_(seed, Stream::kTreadHoles) {
  for (const SolidBox& solid : world.solids) {
    if (solid.is_glass) glass_.push_back(solid.box());
  }
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const Step& step = world.steps[k];
    if (!step.is_walkable) continue;
    treads_.push_back({step.true_T_step.inverse(), step, noise_.uniform(k) < errors.hole_treads});
  }
  for (const Tread& tread : treads_) {
    const Step& step = tread.step;
    for (const double x_m : {step.nosing_x_m, step.back_x_m + step.beneath_m}) {
      for (const double y_m : {step.half_width_m, -step.half_width_m}) {
        const double corner_m = (step.true_T_step * Vec3(x_m, y_m, step.height_m)).z();
        lowest_m_ = std::min(lowest_m_, corner_m - step.worn_m - 2.0 * kOn_m);
      }
    }
  }
  if (treads_.empty()) return;
  // On one of the treads that the robot sees from the floor.
  const CounterNoise sun(seed, Stream::kSunPatch);
  constexpr std::uint64_t kLower = 4;
  const Step& lit = treads_[sun.bits(0) % std::min<std::uint64_t>(kLower, treads_.size())].step;
  sun_place_m_ =
      lit.true_T_step * Vec3(sun.uniform(1, lit.nosing_x_m, lit.back_x_m), sun.uniform(2, -0.25, 0.25), lit.height_m);
  sun_ray_ = Vec3{sun.uniform(3, -0.6, 0.6), sun.uniform(4, -0.6, 0.6), 1.0}.normalized();
}

bool DepthHoles::is_lost(const Tread& tread, const Vec3& step_p_m, int u, int v, Draws& draws) const {
  const bool on_strip = step_p_m.x() < tread.step.edge_x_m() + errors_.nosing_strip_m;
  if (on_strip && errors_.nosing_strip_m > 0.0) return true;
  return tread.holed && (draws.is_dark(u, v) || draws.is_shiny(step_p_m.head<2>()));
}

bool DepthHoles::is_on(const Step& step, const Vec3& step_p_m) const {
  const double round_m = step_p_m.x() < step.edge_x_m() ? step.worn_m : 0.0;
  return step_p_m.z() - step.height_m >= -kOn_m - round_m && step_p_m.x() >= step.nosing_x_m - kOn_m &&
         step_p_m.x() <= step.back_x_m + step.beneath_m && std::abs(step_p_m.y()) <= step.half_width_m;
}

void DepthHoles::apply(const DepthRenderer& picture, const DepthScene& first, const DepthScene& last,
                       std::uint64_t frame, std::uint16_t* depth) const {
  const double holes = std::max({errors_.dark_share, errors_.shiny_share, errors_.nosing_strip_m, errors_.sun_patch_m});
  if (holes <= 0.0 && glass_.empty()) return;
  const CameraIntrinsics& k = picture.intrinsics();
  const Transform &from = first.true_T_camera, &to = last.true_T_camera;
  Draws draws(errors_, noise_, frame);
  std::vector<AlongRow> step_p(treads_.size()), glass_p(glass_.size());
  const bool sun = errors_.sun_patch_m > 0.0;
  std::size_t hit = 0;
  for (int v = 0; v < k.height_px; ++v) {
    const double s = picture.moment_of(v);
    const Mat3 R = from.R + s * (to.R - from.R);
    const AlongRow true_p{from.p_m + s * (to.p_m - from.p_m),
                          R * Vec3{-k.cx_px / k.fx_px, (v - k.cy_px) / k.fy_px, 1.0}, R.col(0) / k.fx_px};
    const AlongRow off_ray{(true_p.at - sun_place_m_).cross(sun_ray_), true_p.at_zero.cross(sun_ray_),
                           true_p.per_px.cross(sun_ray_)};
    for (std::size_t i = 0; i < treads_.size(); ++i) {
      const Transform& step_T_true = treads_[i].step_T_true;
      step_p[i] = {step_T_true * true_p.at, step_T_true.R * true_p.at_zero, step_T_true.R * true_p.per_px};
    }
    for (std::size_t i = 0; i < glass_.size(); ++i) {
      const Transform glass_T_true = glass_[i].centre.inverse();
      glass_p[i] = {glass_T_true * true_p.at, glass_T_true.R * true_p.at_zero, glass_T_true.R * true_p.per_px};
    }
    const float* inverse_depth = picture.inverse_depth(v);
    for (int u = 0; u < k.width_px; ++u, ++depth) {
      if (*depth == 0 || inverse_depth[u] <= 0.0F) continue;
      const double depth_m = 1.0 / static_cast<double>(inverse_depth[u]);
      if (sun && off_ray(u, depth_m).squaredNorm() < math::square(errors_.sun_patch_m)) {
        *depth = 0;
        continue;
      }
      for (std::size_t i = 0; i < glass_.size(); ++i) {
        if (is_behind(glass_p[i], glass_[i].half_m, u, depth_m)) *depth = 0;
      }
      if (holes <= 0.0 || true_p.z(u, depth_m) < lowest_m_) continue;
      // The pixel beside is mostly of the same tread.
      for (std::size_t round = 0; round <= treads_.size(); ++round) {
        const std::size_t i = round == 0 ? hit : round - 1;
        if (round > 0 && i == hit) continue;
        const Tread& tread = treads_[i];
        const double above_m = step_p[i].z(u, depth_m) - tread.step.height_m;
        if (above_m > kOn_m || above_m < -kOn_m - tread.step.worn_m) continue;
        const Vec3 step_p_m = step_p[i](u, depth_m);
        if (!is_on(tread.step, step_p_m)) continue;
        if (is_lost(tread, step_p_m, u, v, draws)) *depth = 0;
        hit = i;
        break;
      }
    }
  }
}

}  // namespace polygmap::sim
