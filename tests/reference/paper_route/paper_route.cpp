// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/paper_route.hpp"

namespace polygmap {

PaperRoute::Params PaperRoute::published() noexcept {
  Params params;
  params.diffusion.iterations = 60;
  params.diffusion.kappa_m = 0.0335;
  params.min_region_px = 5000 / 4;
  params.planes.trials = 20;
  params.planes.inlier_sigmas = 0.0;
  params.planes.inlier_floor_m = 0.010;
  params.planes.enough_inliers = 0.95;
  params.min_inlier_share = 0.95;
  params.seed_tilt_rad = 0.436;
  return params;
}

void PaperRoute::run(const std::uint16_t* depth, const CameraIntrinsics& intrinsics, const Vec3& camera_up) noexcept {
  planes_.clear();
  rays_.set(intrinsics);
  reduction_.set(params_.reduction, intrinsics.depth_unit_m);
  smooth(depth, intrinsics.width_px);
  for (std::int32_t r = 0; r < rays_.height_px; ++r) {
    normals_.estimate_row(params_.normals, rays_, smoothed_, r, normal_image_);
    classify_row(r, camera_up);
  }
  find_edges();
  find_regions();
  for (std::size_t k = 1; k <= regions_.region_count(); ++k) {
    PaperPlane found;
    plane_of_[k] = RegionLabelling::kMaxRegions;
    if (!try_fit(k, camera_up, found)) continue;
    outline(k, found);
    if (found.polygon.size() < 3) continue;
    plane_of_[k] = planes_.size();
    static_cast<void>(planes_.try_push_back(found));
  }
}

void PaperRoute::smooth(const std::uint16_t* depth, std::int32_t width_px) noexcept {
  const std::int32_t width = rays_.width_px, height = rays_.height_px;
  for (std::int32_t r = 0; r < height; ++r) {
    const std::uint16_t* upper = depth + static_cast<std::ptrdiff_t>(2 * r) * width_px;
    reduction_.reduce_row(upper, upper + width_px, width, measured_.row(r), flags_.row(r));
  }
  for (std::int32_t r = 0; r < height; ++r) fill_holes_row(measured_, flags_, r, width, height, smoothed_.row(r));
  for (std::int32_t i = 0; i < params_.diffusion.iterations; ++i) {
    diffusion_.begin_iteration();
    for (std::int32_t r = 0; r < height; ++r) {
      diffusion_.step_row(params_.diffusion, params_.noise, smoothed_, r, width, height);
    }
  }
}

void PaperRoute::find_edges() noexcept {
  const std::int32_t height = rays_.height_px;
  for (std::int32_t r = 0; r < height; ++r) edges_.gradient_row(params_.edges, rays_, normal_image_, smoothed_, r);
  for (std::int32_t r = 0; r < height; ++r) edges_.suppress_row(params_.edges, rays_, r);
  for (std::int32_t i = 0; i < params_.edges.sweeps; ++i) {
    const bool downwards = i % 2 == 0;
    for (std::int32_t r = 0; r < height; ++r) {
      edges_.grow_row(rays_.width_px, height, downwards ? r : height - 1 - r, downwards);
    }
  }
}

void PaperRoute::classify_row(std::int32_t row, const Vec3& camera_up) noexcept {
  const std::int16_t* x = normal_image_.x.row(row);
  const std::int16_t* y = normal_image_.y.row(row);
  const std::int16_t* z = normal_image_.z.row(row);
  std::uint8_t* c = classes_.row(row);
  const auto ux = static_cast<float>(camera_up.x()), uy = static_cast<float>(camera_up.y()),
             uz = static_cast<float>(camera_up.z());
  const auto level = static_cast<float>(math::cos(params_.seed_tilt_rad)) * kNormalScale;
  const auto upright = static_cast<float>(math::sin(params_.seed_tilt_rad)) * kNormalScale;
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    const float up = ux * static_cast<float>(x[i]) + uy * static_cast<float>(y[i]) + uz * static_cast<float>(z[i]);
    const PixelClass measured = up > level ? kLevel : std::abs(up) < upright ? kUpright : kNeither;
    c[i] = (x[i] | y[i] | z[i]) != 0 ? measured : kNeither;
  }
}

void PaperRoute::find_regions() noexcept {
  const auto jump = static_cast<float>(params_.join_jump_m), per_m2 = static_cast<float>(params_.join_jump_per_m2);
  const auto inside = [this](std::int32_t c, std::int32_t r) {
    return classes_(c, r) != kNeither && !edges_.edge(c, r);
  };
  const auto joined = [&](std::int32_t c0, std::int32_t r0, std::int32_t c1, std::int32_t r1) {
    const float a = smoothed_(c0, r0), b = smoothed_(c1, r1);
    return classes_(c0, r0) == classes_(c1, r1) && std::abs(a - b) < jump * a * b + per_m2;
  };
  regions_.begin();
  for (std::int32_t r = 0; r < rays_.height_px; ++r) regions_.scan_row(r, rays_.width_px, inside, joined);
  regions_.resolve(params_.min_region_px);
  sample_count_.fill(0);
  sample_wait_px_.fill(0);
  for (std::int32_t r = 0; r < rays_.height_px; ++r) {
    regions_.label_row(r, rays_.width_px);
    sample_row(r);
  }
}

// Every so many-th measured pixel of each region into its list.
void PaperRoute::sample_row(std::int32_t row) noexcept {
  const std::uint16_t* label = regions_.labels().row(row);
  const float* w = measured_.row(row);
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    const std::uint16_t k = label[i];
    if (k == 0) continue;
    region_class_[k] = classes_(i, row);
    if (w[i] <= 0.0F || sample_wait_px_[k]-- > 0 || sample_count_[k] >= kSamplesPerRegion) continue;
    sample_wait_px_[k] = static_cast<std::int32_t>(regions_.region(k).area_px / kSamplesPerRegion);
    samples_[k][sample_count_[k]++] = {rays_.x[static_cast<std::size_t>(i)], rays_.y[static_cast<std::size_t>(row)],
                                       w[i]};
  }
}

bool PaperRoute::try_fit(std::size_t region, const Vec3& camera_up, PaperPlane& found) noexcept {
  const std::span<const PlaneSample> samples{samples_[region].data(), sample_count_[region]};
  if (samples.size() < 16) return false;
  const bool level = region_class_[region] == kLevel;
  const Lean lean = level ? Lean::kLevel : Lean::kUpright;
  found.kind = level ? SurfaceKind::kTread : SurfaceKind::kRiser;
  ransac_.begin(static_cast<std::uint32_t>(region), samples);
  while (!ransac_.step(params_.planes, params_.noise, lean, camera_up)) {
  }
  std::int32_t inliers = 0;
  return ransac_.try_finish(params_.planes, params_.noise, lean, camera_up, found.plane, inliers) &&
         inliers > params_.min_inlier_share * static_cast<double>(samples.size());
}

void PaperRoute::outline(std::size_t region, PaperPlane& found) noexcept {
  const RegionLabelling::Region& seen = regions_.region(region);
  // A contour that found no room is cut short: the polygon spans the part that did.
  static_cast<void>(try_trace_contour(regions_.labels(), static_cast<std::uint16_t>(region),
                                      {seen.first_column, seen.first_row}, rays_.width_px, rays_.height_px, contour_));
  convex_.begin();
  convex_.add(contour_);
  convex_.build(kMaxPolygonVertices, outline_);
  // Clockwise in the picture is clockwise seen from the camera: reversed.
  for (std::size_t i = outline_.size(); i-- > 0;) {
    const Vec3 ray = rays_.ray(outline_[i].x(), outline_[i].y());
    if (found.plane.inverse_depth(ray) > 0.1) static_cast<void>(found.polygon.try_push_back(found.plane.point(ray)));
  }
}

}  // namespace polygmap
