// SPDX-License-Identifier: Apache-2.0
#include "tests/support/depth_scene.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <random>

namespace polygmap::test {
namespace {

constexpr double kFar_m = 6.0;

// Entry distance of the ray origin + t direction into the box and the axis of the face; infinity when missed.
double enter(const SceneBox& box, const Vec3& origin, const Vec3& direction, int& axis) {
  double near = 1e-3, far = std::numeric_limits<double>::infinity();
  axis = -1;
  for (int i = 0; i < 3; ++i) {
    double t0 = (box.min_m[i] - origin[i]) / direction[i], t1 = (box.max_m[i] - origin[i]) / direction[i];
    if (t0 > t1) std::swap(t0, t1);
    if (t0 > near) {
      near = t0;
      axis = i;
    }
    far = std::min(far, t1);
  }
  return axis >= 0 && near <= far ? near : std::numeric_limits<double>::infinity();
}

// First z below limit_m at which the ray (x, y, 1) comes within a tenth of a millimetre of the shape.
template <typename Shape>
double march(const Shape& shape, const Vec3& ray, double limit_m) {
  const double length = ray.norm();
  double t = 0.0;
  for (int i = 0; i < 80 && t < limit_m * length; ++i) {
    const double distance = signed_distance_m(shape, ray / length * t);
    if (distance < 1e-4) return t / length;
    t += distance;
  }
  return std::numeric_limits<double>::infinity();
}

// Separable wrap-around box blur of width 2 radius + 1, scaled back to unit variance.
std::vector<double> blurred(std::vector<double> image, int width, int height, int radius) {
  std::vector<double> out(image.size());
  const auto pass = [&](int count, int length, auto index) {
    for (int line = 0; line < count; ++line) {
      double sum = 0.0;
      for (int k = -radius; k <= radius; ++k) sum += image[index(line, (k + length) % length)];
      for (int i = 0; i < length; ++i) {
        out[index(line, i)] = sum;
        sum += image[index(line, (i + radius + 1) % length)] - image[index(line, (i - radius + length) % length)];
      }
    }
    std::swap(image, out);
  };
  pass(height, width, [width](int line, int i) { return static_cast<std::size_t>(line * width + i); });
  pass(width, height, [width](int line, int i) { return static_cast<std::size_t>(i * width + line); });
  double sum = 0.0, squares = 0.0;
  for (const double v : image) {
    sum += v;
    squares += v * v;
  }
  const double n = static_cast<double>(image.size());
  const double deviation = std::sqrt(squares / n - math::square(sum / n));
  for (double& v : image) v /= deviation;
  return image;
}

}  // namespace

void DepthScene::place_camera(double height_m, double pitch_rad, double yaw_rad, double roll_rad, double y_m) {
  Mat3 ahead;  // optical axis along x, picture's right along -y
  ahead << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  world_T_camera = {rotation_z(yaw_rad) * rotation_y(pitch_rad) * ahead * rotation_z(roll_rad),
                    Vec3{0.0, y_m, height_m}};
}

void DepthScene::add_stairs(const StairSpec& s) {
  constexpr double kSlab_m = 0.03;
  for (int k = 0; k < s.steps; ++k) {
    const double x = s.first_riser_x_m + k * s.tread_m, top = (k + 1) * s.rise_m;
    const double end = s.first_riser_x_m + (s.steps - 1) * s.tread_m + s.landing_m;
    boxes.push_back({{x, -s.width_m / 2, 0.0}, {end, s.width_m / 2, top}});
    if (s.nosing_m > 0.0) {
      boxes.push_back({{x - s.nosing_m, -s.width_m / 2, top - kSlab_m}, {x, s.width_m / 2, top}});
    }
  }
}

std::vector<std::uint16_t> DepthPicture::raw() const {
  std::vector<std::uint16_t> out(depth_m.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint16_t>(std::clamp(std::round(depth_m[i] / intrinsics.depth_unit_m), 0.0, 65535.0));
  }
  return out;
}

DepthPicture render(const DepthScene& scene) {
  const CameraIntrinsics& k = scene.intrinsics;
  DepthPicture picture{k, {}, {}};
  const auto size = static_cast<std::size_t>(k.width_px) * static_cast<std::size_t>(k.height_px);
  picture.depth_m.assign(size, 0.0);
  picture.cosine.assign(size, 1.0);
  const Vec3 origin = scene.world_T_camera.p_m;
  for (std::int32_t v = 0; v < k.height_px; ++v) {
    for (std::int32_t u = 0; u < k.width_px; ++u) {
      const Vec3 ray{(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, 1.0};
      const Vec3 direction = scene.world_T_camera.R * ray;
      double best = kFar_m;
      double cosine = 1.0;
      if (scene.floor && direction.z() < 0.0 && -origin.z() / direction.z() < best) {
        best = -origin.z() / direction.z();
        cosine = -direction.z() / ray.norm();
      }
      for (const SceneBox& box : scene.boxes) {
        int axis = 0;
        const double t = enter(box, origin, direction, axis);
        if (t >= best) continue;
        best = t;
        cosine = std::abs(direction[axis]) / ray.norm();
      }
      double nearest = best;
      for (const LegShapes& leg : scene.legs) {
        for (const Capsule* capsule : {&leg.thigh, &leg.shank}) {
          if (capsule->radius_m > 0.0) nearest = std::min(nearest, march(*capsule, ray, nearest));
        }
        if (leg.foot.half_m.minCoeff() > 0.0) nearest = std::min(nearest, march(leg.foot, ray, nearest));
      }
      if (nearest < best) {
        best = nearest;
        cosine = 1.0;
      }
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width_px) + static_cast<std::size_t>(u);
      if (best < kFar_m) picture.depth_m[i] = best;
      picture.cosine[i] = cosine;
    }
  }
  return picture;
}

void add_noise(DepthPicture& picture, const NoiseSpec& noise, std::uint32_t seed) {
  constexpr double kJump_m = 0.03;
  std::mt19937 random(seed);
  std::normal_distribution<> normal;
  std::uniform_real_distribution<> uniform;
  const int width = picture.intrinsics.width_px, height = picture.intrinsics.height_px;
  const std::vector<double> clean = picture.depth_m;
  const auto field = [&] {
    std::vector<double> out(clean.size());
    for (double& v : out) v = normal(random);
    return out;
  };
  std::vector<double> unit = field();
  std::vector<double> warp(clean.size(), 0.0);
  if (noise.correlated) {
    const std::vector<double> smooth = blurred(field(), width, height, 4);
    for (std::size_t i = 0; i < unit.size(); ++i) unit[i] = 0.5 * unit[i] + 0.87 * smooth[i];
    warp = blurred(field(), width, height, 35);
  }
  const double limit = std::cos(75.0 * kPi / 180.0);
  for (std::size_t i = 0; i < clean.size(); ++i) {
    const double sigma = (0.001 + 0.0015 * clean[i]) / std::max(picture.cosine[i], limit);
    picture.depth_m[i] += noise.strength * (sigma * unit[i] + 0.002 * warp[i]);
  }
  for (const int step : {1, width}) {
    for (std::size_t i = 0; i + static_cast<std::size_t>(step) < clean.size(); ++i) {
      const double other = clean[i + static_cast<std::size_t>(step)];
      if (step == 1 && i % static_cast<std::size_t>(width) == static_cast<std::size_t>(width - 1)) continue;
      if (std::abs(other - clean[i]) < kJump_m || other == 0.0 || clean[i] == 0.0 || uniform(random) > 0.4) continue;
      const double w = uniform(random);
      picture.depth_m[i] = w * clean[i] + (1.0 - w) * other;
    }
  }
  if (noise.correlated && noise.dropout > 0.0) {
    const std::vector<double> blob = blurred(field(), width, height, 2);
    std::vector<double> sorted = blob;
    const auto nth =
        sorted.begin() + static_cast<std::ptrdiff_t>((1.0 - noise.dropout) * static_cast<double>(sorted.size()));
    std::nth_element(sorted.begin(), nth, sorted.end());
    for (std::size_t i = 0; i < clean.size(); ++i) picture.depth_m[i] = blob[i] > *nth ? 0.0 : picture.depth_m[i];
  } else {
    for (double& z : picture.depth_m) z = uniform(random) < noise.dropout ? 0.0 : z;
  }
  for (std::size_t i = 0; i < clean.size(); ++i) picture.depth_m[i] = clean[i] == 0.0 ? 0.0 : picture.depth_m[i];
}

}  // namespace polygmap::test
