// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_extractor.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace polygmap {
namespace {

constexpr std::int32_t kMinSide_px = 32;
constexpr double kStepLeast_m = 0.01;  // a neighbour's centre is this far above or below to count as such
constexpr double kOnLine_m = 0.002;    // a polygon's edge lies on a line

bool finite(const LegShapes& s) noexcept {
  return math::all_finite(s.thigh.a_m) && math::all_finite(s.thigh.b_m) && std::isfinite(s.thigh.radius_m) &&
         math::all_finite(s.shank.a_m) && math::all_finite(s.shank.b_m) && std::isfinite(s.shank.radius_m) &&
         math::all_finite(s.foot.centre.R) && math::all_finite(s.foot.centre.p_m) && math::all_finite(s.foot.half_m);
}

bool usable(const CameraIntrinsics& k) noexcept {
  const auto positive = [](double x) { return x > 1.0 && x < 1e5; };
  return k.width_px >= kMinSide_px && k.width_px <= kDepthWidth_px && k.height_px >= kMinSide_px &&
         k.height_px <= kDepthHeight_px && k.width_px % 2 == 0 && k.height_px % 2 == 0 && positive(k.fx_px) &&
         positive(k.fy_px) && std::abs(k.cx_px) < 1e5 && std::abs(k.cy_px) < 1e5 && k.depth_unit_m > 1e-6 &&
         k.depth_unit_m < 0.1;
}

// The lean that a kind of seed or plane implies.
SurfaceKind kind_of(const InversePlane& plane, const Vec3& up, double tilt_rad) noexcept {
  const double c = plane.normal().dot(up);
  if (c > math::cos(tilt_rad)) return SurfaceKind::kTread;
  if (std::abs(c) < math::sin(tilt_rad)) return SurfaceKind::kRiser;
  return SurfaceKind::kOther;
}

Lean lean_of(SurfaceKind kind) noexcept {
  if (kind == SurfaceKind::kTread) return Lean::kLevel;
  return kind == SurfaceKind::kRiser ? Lean::kUpright : Lean::kAny;
}

}  // namespace

void SurfaceExtractor::Box::add(std::int32_t column, std::int32_t row) noexcept {
  left = std::min(left, static_cast<std::int16_t>(column));
  right = std::max(right, static_cast<std::int16_t>(column));
  top = std::min(top, static_cast<std::int16_t>(row));
  bottom = std::max(bottom, static_cast<std::int16_t>(row));
}
void SurfaceExtractor::Box::add(const Box& other) noexcept {
  left = std::min(left, other.left);
  right = std::max(right, other.right);
  top = std::min(top, other.top);
  bottom = std::max(bottom, other.bottom);
}
void SurfaceExtractor::Box::grow(std::int32_t by_px) noexcept {
  const auto by = static_cast<std::int16_t>(by_px);
  left = static_cast<std::int16_t>(std::max(0, left - by));
  top = static_cast<std::int16_t>(std::max(0, top - by));
  right = static_cast<std::int16_t>(std::min(kHalfWidth_px - 1, right + by));
  bottom = static_cast<std::int16_t>(std::min(kHalfHeight_px - 1, bottom + by));
}

bool SurfaceExtractor::try_begin(const DepthFrameView& frame, const View& view) noexcept {
  if (busy()) {
    ++counters_.busy;
    return false;
  }
  const double up_norm = view.camera_up.norm();
  if (!usable(view.intrinsics) || !(std::abs(up_norm - 1.0) < 0.01) || !(view.body_margin_m >= 0.0) ||
      !(view.body_margin_m < 0.5) || !finite(view.body[0]) || !finite(view.body[1])) {
    ++counters_.bad_view;
    return false;
  }
  if (frame.depth == nullptr || frame.width_px != view.intrinsics.width_px ||
      frame.height_px != view.intrinsics.height_px) {
    ++counters_.bad_frame;
    return false;
  }
  if (any_frame_ && frame.stamp_ns <= last_stamp_ns_) {
    ++counters_.bad_order;
    return false;
  }
  any_frame_ = true;
  last_stamp_ns_ = frame.stamp_ns;
  ++counters_.frames;
  view_ = view;
  view_.camera_up /= up_norm;
  for (std::int32_t r = 0; r < frame.height_px; ++r) {
    const std::uint16_t* source = frame.depth + static_cast<std::ptrdiff_t>(r) * frame.width_px;
    std::copy(source, source + frame.width_px, full_.row(r));
  }
  rays_.set(view.intrinsics);
  raw_.depth = &full_;
  raw_.flags = &flags_;
  raw_.intrinsics = view.intrinsics;
  raw_.reduction.set(params_.reduction, view.intrinsics.depth_unit_m);
  self_filter_.clear();
  next_.stamp_ns = frame.stamp_ns;
  next_.sequence = frame.sequence;
  next_.surfaces.clear();
  next_.dropped = 0;
  measured_px_ = outside_body_px_ = 0;
  plane_count_ = 0;
  round_ = 0;
  seed_planes_ = 0;
  units_spent_ = 0;
  enter(Phase::kMask);
  return true;
}

Progress SurfaceExtractor::step(WorkBudget& budget) noexcept {
  if (!busy()) return Progress::kIdle;
  while (!budget.exhausted()) {
    const std::int32_t units = run_piece();
    budget.spend(units);
    units_spent_ += units;
    if (!busy()) return Progress::kDone;
  }
  return Progress::kBusy;
}

void SurfaceExtractor::enter(Phase phase) noexcept {
  phase_ = phase;
  row_ = 0;
  repeat_ = 0;
  index_ = 0;
  started_ = false;
}

bool SurfaceExtractor::next_row() noexcept { return ++row_ < rays_.height_px; }

// One case per phase and nothing nested in it: long, but flat.
// NOLINTNEXTLINE(readability-function-cognitive-complexity,readability-function-size)
std::int32_t SurfaceExtractor::run_piece() noexcept {
  switch (phase_) {
    case Phase::kIdle:
      return 1;
    case Phase::kMask:
      self_filter_.add_shape(rays_, view_.body, view_.body_margin_m, index_);
      if (++index_ == SelfFilter::kShapes) enter(Phase::kReduce);
      return 20;
    case Phase::kReduce:
      reduce_row();
      if (!next_row()) enter(Phase::kFill);
      return 3;
    case Phase::kFill:
      fill_holes_row(measured_, flags_, row_, rays_.width_px, rays_.height_px, smoothed_.row(row_));
      if (!next_row()) {
        if (measured_px_ == 0) {
          ++counters_.blank_frames;
          enter(Phase::kFinish);
        } else {
          enter(Phase::kDiffuse);
          diffusion_.begin_iteration();
        }
      }
      return 1;
    case Phase::kDiffuse: {
      const std::int32_t iterations = std::clamp(params_.diffusion.iterations, 0, AnisotropicDiffusion::kMaxIterations);
      if (iterations == 0) {
        enter(Phase::kNormals);
        return 1;
      }
      diffusion_.step_row(params_.diffusion, params_.noise, smoothed_, row_, rays_.width_px, rays_.height_px);
      if (!next_row()) {
        row_ = 0;
        diffusion_.begin_iteration();
        if (++repeat_ == iterations) enter(Phase::kNormals);
      }
      return 1;
    }
    case Phase::kNormals:
      normal_estimation_.estimate_row(params_.normals, rays_, smoothed_, row_, normal_image_);
      classify_row();
      if (!next_row()) enter(Phase::kGradient);
      return 3;
    case Phase::kGradient:
      edge_detection_.gradient_row(params_.edges, rays_, normal_image_, smoothed_, row_);
      if (!next_row()) enter(Phase::kSuppress);
      return 3;
    case Phase::kSuppress:
      edge_detection_.suppress_row(params_.edges, rays_, row_);
      if (!next_row()) enter(Phase::kGrow);
      return 1;
    case Phase::kGrow: {
      const bool downwards = repeat_ % 2 == 0;
      edge_detection_.grow_row(rays_.width_px, rays_.height_px, downwards ? row_ : rays_.height_px - 1 - row_,
                               downwards);
      if (!next_row()) {
        row_ = 0;
        if (++repeat_ >= std::clamp(params_.edges.sweeps, 1, EdgeDetection::kMaxSweeps)) {
          enter(Phase::kSeedScan);
          regions_.begin();
        }
      }
      return 1;
    }
    case Phase::kSeedScan:
      seed_row();
      if (!next_row()) enter(Phase::kSeedResolve);
      return 2;
    case Phase::kSeedResolve:
      regions_.resolve(static_cast<std::uint32_t>(std::max(params_.min_region_px, 3)));
      counters_.region_overflow += regions_.overflow();
      sample_count_.fill(0);
      sample_wait_px_.fill(0);
      region_box_.fill(Box{});
      enter(Phase::kSeedLabel);
      return kMaxPieceUnits;
    case Phase::kSeedLabel:
      label_seed_row();
      if (!next_row()) enter(Phase::kRansac);
      return 1;
    case Phase::kRansac:
      return ransac_step();
    case Phase::kMerge:
      if (round_ == 1 && plane_count_ == seed_planes_) {
        enter(Phase::kRefit);
        return 1;
      }
      merge_planes();
      seed_planes_ = plane_count_;
      if (round_ == 1) ++round_;
      start_round();
      enter(Phase::kAssign);
      return 10;
    case Phase::kAssign: {
      const std::int32_t units = assign_row();
      if (!next_row()) enter(round_ == 1 ? Phase::kLeftoverScan : Phase::kRefit);
      return units;
    }
    case Phase::kRefit:
      // Rounds: 0 sharpens the seed regions' planes, 1 assigns all pixels, 2 again if what 1 left over gave new planes.
      refit();
      // After the last round nobody would hand a merged plane's pixels to the one that stays.
      if (round_ == 0) merge_planes();
      enter(round_ == 0 ? Phase::kAssign : Phase::kClean);
      ++round_;
      start_round();
      return 10;
    case Phase::kLeftoverScan:
      if (row_ == 0) regions_.begin();
      leftover_row();
      if (!next_row()) enter(Phase::kLeftoverResolve);
      return 1;
    case Phase::kLeftoverResolve:
      regions_.resolve(static_cast<std::uint32_t>(std::max(params_.min_leftover_px, 3)));
      counters_.region_overflow += regions_.overflow();
      sample_count_.fill(0);
      sample_wait_px_.fill(0);
      region_box_.fill(Box{});
      enter(Phase::kLeftoverLabel);
      return kMaxPieceUnits;
    case Phase::kLeftoverLabel:
      label_seed_row();
      if (!next_row()) enter(Phase::kRansac);
      return 1;
    case Phase::kClean:
      clean_row();
      if (!next_row()) {
        enter(Phase::kPieceScan);
        regions_.begin();
      }
      return 2;
    case Phase::kPieceScan:
      piece_row();
      if (!next_row()) enter(Phase::kPieceResolve);
      return 1;
    case Phase::kPieceResolve:
      regions_.resolve(static_cast<std::uint32_t>(std::max(params_.min_component_px, 1)));
      counters_.region_overflow += regions_.overflow();
      pieces_.fill(Piece{});
      enter(Phase::kPieceLabel);
      return kMaxPieceUnits;
    case Phase::kPieceLabel:
      label_piece_row();
      if (!next_row()) enter(Phase::kPieceJoin);
      return 1;
    case Phase::kPieceJoin:
      join_pieces();
      enter(Phase::kProfile);
      return 10;
    case Phase::kProfile:
      profile_row();
      if (!next_row()) {
        enter(Phase::kOutline);
        index_ = 1;
      }
      return 1;
    case Phase::kOutline:
      // index_ is the plane, repeat_ the piece.
      if (index_ > plane_count_) {
        enter(Phase::kFinish);
        return 1;
      }
      if (!planes_[index_].alive) {
        ++index_;
        return 1;
      }
      outline_piece();
      return 20;
    case Phase::kNosing:
      return line_step(true);
    case Phase::kBack:
      return line_step(false);
    case Phase::kPolygon: {
      build_polygon();
      const std::size_t next = index_ + 1;
      enter(Phase::kOutline);
      index_ = next;
      return 20;
    }
    case Phase::kFinish:
      finish();
      enter(Phase::kIdle);
      return 1;
  }
  return 1;
}

void SurfaceExtractor::reduce_row() noexcept {
  std::uint8_t* flags = flags_.row(row_);
  float* w = measured_.row(row_);
  raw_.reduction.reduce_row(full_.row(2 * row_), full_.row(2 * row_ + 1), rays_.width_px, w, flags);
  self_filter_.mark_row(row_, rays_.width_px, flags);
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    if ((flags[i] & kPixelBody) != 0) {
      w[i] = 0.0F;
    } else {
      ++outside_body_px_;
      measured_px_ += (flags[i] & kPixelMeasured) != 0 ? 1 : 0;
    }
  }
}

void SurfaceExtractor::classify_row() noexcept {
  const std::int16_t* x = normal_image_.x.row(row_);
  const std::int16_t* y = normal_image_.y.row(row_);
  const std::int16_t* z = normal_image_.z.row(row_);
  std::uint8_t* c = assigned_.row(row_);
  const auto ux = static_cast<float>(view_.camera_up.x()), uy = static_cast<float>(view_.camera_up.y()),
             uz = static_cast<float>(view_.camera_up.z());
  const auto level = static_cast<float>(math::cos(params_.seed_tilt_rad)) * kNormalScale;
  const auto upright = static_cast<float>(math::sin(params_.seed_tilt_rad)) * kNormalScale;
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    const float up = ux * static_cast<float>(x[i]) + uy * static_cast<float>(y[i]) + uz * static_cast<float>(z[i]);
    const PixelClass measured = up > level ? kLevel : std::abs(up) < upright ? kUpright : kNeither;
    c[i] = (x[i] | y[i] | z[i]) != 0 ? measured : kNeither;
  }
}

void SurfaceExtractor::seed_row() noexcept {
  const auto jump = static_cast<float>(params_.join_jump_m), per_m2 = static_cast<float>(params_.join_jump_per_m2);
  const auto inside = [this](std::int32_t c, std::int32_t r) {
    return assigned_(c, r) != kNeither && !edge_detection_.edge(c, r);
  };
  const auto joined = [&](std::int32_t c0, std::int32_t r0, std::int32_t c1, std::int32_t r1) {
    const float a = smoothed_(c0, r0), b = smoothed_(c1, r1);
    return assigned_(c0, r0) == assigned_(c1, r1) && std::abs(a - b) < jump * a * b + per_m2;
  };
  regions_.scan_row(row_, rays_.width_px, inside, joined);
}

void SurfaceExtractor::leftover_row() noexcept {
  const auto jump = static_cast<float>(params_.join_jump_m), per_m2 = static_cast<float>(params_.join_jump_per_m2);
  const auto inside = [this](std::int32_t c, std::int32_t r) { return assigned_(c, r) == 0 && measured_(c, r) > 0.0F; };
  const auto joined = [&](std::int32_t c0, std::int32_t r0, std::int32_t c1, std::int32_t r1) {
    const float a = smoothed_(c0, r0), b = smoothed_(c1, r1);
    return std::abs(a - b) < jump * a * b + per_m2;
  };
  regions_.scan_row(row_, rays_.width_px, inside, joined);
}

// Final labels of the row, and every stride-th measured pixel of each region into its sample list.
void SurfaceExtractor::label_seed_row() noexcept {
  regions_.label_row(row_, rays_.width_px);
  const std::uint16_t* label = regions_.labels().row(row_);
  const float* w = measured_.row(row_);
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    const std::uint16_t k = label[i];
    if (k == 0) continue;
    region_box_[k].add(i, row_);
    region_class_[k] = round_ == 0 ? assigned_(i, row_) : std::uint8_t{kNeither};
    if (w[i] <= 0.0F) continue;
    if (sample_wait_px_[k]-- > 0 || sample_count_[k] >= kSamplesPerRegion) continue;
    sample_wait_px_[k] = static_cast<std::int32_t>(regions_.region(k).area_px / kSamplesPerRegion);
    samples_[k][sample_count_[k]++] = {rays_.x[static_cast<std::size_t>(i)], rays_.y[static_cast<std::size_t>(row_)],
                                       w[i]};
  }
}

std::int32_t SurfaceExtractor::ransac_step() noexcept {
  // index_ is the region - 1, repeat_ the lean that is tried, started_ whether its draws have begun.
  const std::size_t region = index_ + 1;
  if (region > regions_.region_count()) {
    enter(Phase::kMerge);
    return 1;
  }
  const std::span<const PlaneSample> samples{samples_[region].data(), sample_count_[region]};
  if (!started_) {
    if (samples.size() < 16) {
      ++index_;
      return 1;
    }
    ransac_.begin(static_cast<std::uint32_t>(region + 101 * static_cast<std::size_t>(round_)), samples);
    started_ = true;
  }
  Lean lean = region_class_[region] == kLevel ? Lean::kLevel : Lean::kUpright;
  if (round_ > 0) lean = repeat_ == 0 ? Lean::kLevel : (repeat_ == 1 ? Lean::kUpright : Lean::kAny);
  if (!ransac_.step(params_.planes, params_.noise, lean, view_.camera_up)) return 1;
  InversePlane plane;
  std::int32_t inliers = 0;
  started_ = false;
  if (repeat_ == 0) best_draw_.inliers = static_cast<std::int32_t>(samples.size()) / 2;
  if (ransac_.try_finish(params_.planes, params_.noise, lean, view_.camera_up, plane, inliers) &&
      inliers > best_draw_.inliers) {
    best_draw_ = {plane, lean, inliers, true};
  }
  // What is left over says nothing about its lean: the one that explains most of it is taken.
  if (round_ > 0 && ++repeat_ < 3) return 4;
  if (best_draw_.found) {
    add_plane(best_draw_.plane, best_draw_.lean, region);
  } else {
    ++counters_.no_plane;
  }
  best_draw_ = {};
  repeat_ = 0;
  ++index_;
  return 4;
}

void SurfaceExtractor::add_plane(const InversePlane& plane, Lean lean, std::size_t region) noexcept {
  if (plane_count_ == kMaxPlanes) {
    ++counters_.plane_overflow;
    ++next_.dropped;
    return;
  }
  Plane& p = planes_[++plane_count_];
  p = Plane{};
  p.plane = plane;
  p.lean = lean;
  p.kind = kind_of(plane, view_.camera_up, params_.kind_tilt_rad);
  p.box = region_box_[region];
  p.pixels = regions_.region(region).area_px;
  p.alive = true;
  Vec3 sum = Vec3::Zero();
  std::int32_t n = 0;
  for (std::size_t i = 0; i < sample_count_[region]; ++i) {
    const PlaneSample& s = samples_[region][i];
    sum += Vec3{static_cast<double>(s.x), static_cast<double>(s.y), 1.0};
    ++n;
  }
  const Vec3 ray = sum / std::max(n, 1);
  p.centre_m = plane.inverse_depth(ray) > 1e-3 ? plane.point(ray) : Vec3{ray};
}

// Pieces of one surface that a leg, a hole or noise has split share one plane: the larger one's.
void SurfaceExtractor::merge_planes() noexcept {
  const double same = math::cos(params_.merge_tilt_rad);
  for (std::size_t a = 1; a <= plane_count_; ++a) {
    for (std::size_t b = a + 1; b <= plane_count_ && planes_[a].alive; ++b) {
      Plane &p = planes_[a], &q = planes_[b];
      if (!q.alive || p.kind != q.kind) continue;
      if (p.plane.normal().dot(q.plane.normal()) < same) continue;
      if (std::abs(p.plane.distance_m(q.centre_m)) > params_.merge_m) continue;
      if (std::abs(q.plane.distance_m(p.centre_m)) > 2.0 * params_.merge_m) continue;
      Plane& keep = p.pixels >= q.pixels ? p : q;
      Plane& gone = p.pixels >= q.pixels ? q : p;
      keep.box.add(gone.box);
      keep.pixels += gone.pixels;
      gone.alive = false;
    }
  }
}

// The best plane of every pixel in the row. A residual times d is the residual over sigma up to a factor that all
// planes share, see inverse_depth_sigma.
std::int32_t SurfaceExtractor::assign_row() noexcept {
  constexpr float kNoPlane = 1e9F;
  const std::int32_t width = rays_.width_px;
  const float y = rays_.y[static_cast<std::size_t>(row_)];
  const float* w = measured_.row(row_);
  const auto base = static_cast<float>(params_.assign_sigmas * params_.noise.base_m);
  const auto per_metre = static_cast<float>(params_.assign_sigmas * params_.noise.per_metre);
  const auto floor_m = static_cast<float>(params_.assign_floor_m);
  RowScratch& s = scratch_;
  for (std::int32_t i = 0; i < width; ++i) {
    const auto k = static_cast<std::size_t>(i);
    s.ray_norm[k] = math::sqrt(rays_.x[k] * rays_.x[k] + y * y + 1.0F);
    s.tolerance[k] = w[i] > 0.0F ? (base * w[i] + per_metre) * s.ray_norm[k] : -kNoPlane;
    s.best[k] = kNoPlane;
    s.second[k] = kNoPlane;
    s.plane[k] = 0.0F;
  }
  std::int32_t candidates = 0;
  for (std::size_t p = 1; p <= plane_count_; ++p) {
    const Plane& plane = planes_[p];
    if (!plane.alive) continue;
    Box reach = plane.box;
    reach.grow(params_.reach_px);
    if (row_ < reach.top || row_ > reach.bottom) continue;
    ++candidates;
    const auto mx = static_cast<float>(plane.plane.m.x());
    const auto offset = static_cast<float>(plane.plane.m.y()) * y + static_cast<float>(plane.plane.m.z());
    const auto d = static_cast<float>(plane.plane.d_m());
    const float floor_d = floor_m * d;
    const auto id = static_cast<float>(p);
    const auto last = static_cast<std::size_t>(std::min<std::int32_t>(reach.right, width - 1));
    for (auto k = static_cast<std::size_t>(reach.left); k <= last; ++k) {
      const float score = std::abs(w[k] - (mx * rays_.x[k] + offset)) * d;
      const float allowed = score < s.tolerance[k] + floor_d * w[k] * w[k] ? score : kNoPlane;
      const float worse = allowed < s.second[k] ? allowed : s.second[k];
      s.second[k] = allowed < s.best[k] ? s.best[k] : worse;
      s.plane[k] = allowed < s.best[k] ? id : s.plane[k];
      s.best[k] = allowed < s.best[k] ? allowed : s.best[k];
    }
  }
  std::uint8_t* assigned = assigned_.row(row_);
  for (std::int32_t i = 0; i < width; ++i) {
    assigned[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>(s.plane[static_cast<std::size_t>(i)]));
  }
  // The first round only improves the planes for the next one: every fourth row will do. Then every second pixel, in a
  // chequerboard: neighbours share most of their error anyway.
  if (round_ == 0 && row_ % 4 != 0) return 1 + candidates;
  const double yd = static_cast<double>(y);
  for (std::int32_t i = row_ % 2; i < width; i += 2) {
    const auto k = static_cast<std::size_t>(i);
    // Only pixels that one plane alone explains take part in the fit: none from the seam between two.
    if (assigned[i] == 0 || s.second[k] < kNoPlane) continue;
    Plane& plane = planes_[assigned[i]];
    plane.box.add(i, row_);
    const double x = static_cast<double>(rays_.x[k]), wi = static_cast<double>(w[i]);
    const double predicted = plane.plane.m.x() * x + plane.plane.m.y() * yd + plane.plane.m.z();
    const double inverse_sigma =
        plane.d_m / ((params_.noise.base_m * predicted + params_.noise.per_metre) * static_cast<double>(s.ray_norm[k]));
    plane.moments.add(inverse_sigma * inverse_sigma, x, yd, wi);
    // Distance along the normal: d (1 - predicted / w), as d (w - predicted) z.
    plane.residual2 += math::square((wi - predicted) / predicted * plane.d_m);
  }
  return 2 + candidates;
}

void SurfaceExtractor::refit() noexcept {
  for (std::size_t p = 1; p <= plane_count_; ++p) {
    Plane& plane = planes_[p];
    if (!plane.alive) continue;
    const SurfaceKind kind = kind_of(plane.plane, view_.camera_up, params_.kind_tilt_rad);
    plane.lean = lean_of(kind);
    if (plane.moments.count < 16.0 ||
        !try_solve(params_.planes, plane.moments, plane.lean, view_.camera_up, plane.plane, &plane.covariance)) {
      plane.alive = false;
      continue;
    }
    plane.kind = kind_of(plane.plane, view_.camera_up, params_.kind_tilt_rad);
    plane.pixels = plane.moments.count;
    const Vec3 ray = plane.moments.mean_ray();
    plane.centre_m = plane.plane.inverse_depth(ray) > 1e-3 ? plane.plane.point(ray) : Vec3{ray};
  }
}

void SurfaceExtractor::start_round() noexcept {
  if (phase_ == Phase::kClean) return;  // the last round's moments stay for the result
  for (std::size_t p = 1; p <= plane_count_; ++p) {
    planes_[p].moments = PlaneMoments{};
    planes_[p].residual2 = 0.0;
    planes_[p].d_m = planes_[p].plane.d_m();
  }
}

// A pixel keeps its plane when at least four of its eight neighbours have the same: spurs and bands of a pixel go.
void SurfaceExtractor::clean_row() noexcept {
  const std::int32_t width = rays_.width_px, height = rays_.height_px;
  std::uint8_t* here = assigned_.row(row_);
  const std::uint8_t* below = row_ + 1 < height ? assigned_.row(row_ + 1) : nullptr;
  std::array<std::uint8_t, kHalfWidth_px>& above = scratch_.above;
  std::array<std::uint8_t, kHalfWidth_px>& before = scratch_.here;  // this row before it is cleaned
  if (row_ == 0) above.fill(0);
  std::copy(here, here + width, before.begin());
  for (std::int32_t i = 0; i < width; ++i) {
    const auto own = static_cast<std::size_t>(i);
    const std::uint8_t id = before[own];
    if (id == 0) continue;
    if (i > 0 && i + 1 < width && below != nullptr && row_ > 0 && above[own] == id && below[i] == id &&
        before[own - 1] == id && before[own + 1] == id) {
      continue;
    }
    std::int32_t same = 0, possible = 0;
    for (std::int32_t c = std::max(i - 1, 0); c <= std::min(i + 1, width - 1); ++c) {
      const auto k = static_cast<std::size_t>(c);
      if (row_ > 0) same += above[k] == id ? 1 : 0;
      if (c != i) same += before[k] == id ? 1 : 0;
      if (below != nullptr) same += below[c] == id ? 1 : 0;
      possible += (row_ > 0 ? 1 : 0) + (c != i ? 1 : 0) + (below != nullptr ? 1 : 0);
    }
    if (2 * same < possible) here[i] = 0;
  }
  std::copy(before.begin(), before.begin() + width, above.begin());
}

void SurfaceExtractor::piece_row() noexcept {
  const auto inside = [this](std::int32_t c, std::int32_t r) {
    const std::uint8_t p = assigned_(c, r);
    return p != 0 && planes_[p].alive;
  };
  const auto joined = [this](std::int32_t c0, std::int32_t r0, std::int32_t c1, std::int32_t r1) {
    return assigned_(c0, r0) == assigned_(c1, r1);
  };
  regions_.scan_row(row_, rays_.width_px, inside, joined);
}

void SurfaceExtractor::label_piece_row() noexcept {
  regions_.label_row(row_, rays_.width_px);
  const std::uint16_t* label = regions_.labels().row(row_);
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    if (label[i] == 0) continue;
    Piece& piece = pieces_[label[i]];
    piece.plane = assigned_(i, row_);
    ++piece.area_px;
    piece.sum_column += i;
    piece.sum_row += row_;
  }
}

// Two pieces belong together when nothing but missing data (the robot's leg, dropouts) or their own plane lies between.
// Something seen behind the plane is a hole; something in front of it hides what nobody knows.
bool SurfaceExtractor::apart(const Piece& a, const Piece& b, const InversePlane& plane) const noexcept {
  constexpr int kProbes = 24;
  constexpr int kEnough = 3;
  const Vec2 from = Vec2{a.sum_column, a.sum_row} / a.area_px, to = Vec2{b.sum_column, b.sum_row} / b.area_px;
  int elsewhere = 0;
  for (int i = 0; i <= kProbes; ++i) {
    const Vec2 p = from + (to - from) * (static_cast<double>(i) / kProbes);
    const auto c = static_cast<std::int32_t>(p.x() + 0.5), r = static_cast<std::int32_t>(p.y() + 0.5);
    float w = 0.0F;
    if (!measured_.try_get(c, r, w) || w <= 0.0F) continue;
    const double expected = plane.inverse_depth(rays_.ray(c, r));
    elsewhere += expected > 1e-3 && std::abs(1.0 / static_cast<double>(w) - 1.0 / expected) > params_.apart_m ? 1 : 0;
  }
  return elsewhere >= kEnough;
}

// Regions are sorted by area: the first piece of a plane is its largest. A piece apart from it becomes a surface of its
// own in the same plane.
void SurfaceExtractor::join_pieces() noexcept {
  const std::size_t fitted = plane_count_;
  for (std::size_t p = 1; p <= fitted; ++p) {
    planes_[p].source = static_cast<std::uint8_t>(p);
    planes_[p].main_piece = 0;
    planes_[p].piece_px = 0;
  }
  for (std::size_t k = 1; k <= regions_.region_count(); ++k) {
    Piece& piece = pieces_[k];
    const std::uint8_t source = piece.plane;
    piece.plane = 0;
    for (std::size_t p = 1; p <= plane_count_ && piece.plane == 0; ++p) {
      const Plane& plane = planes_[p];
      if (plane.source != source) continue;
      if (plane.main_piece == 0 || !apart(pieces_[plane.main_piece], piece, plane.plane)) {
        piece.plane = static_cast<std::uint8_t>(p);
      }
    }
    if (piece.plane == 0) {
      if (piece.area_px < static_cast<std::uint32_t>(params_.min_surface_px)) continue;
      if (plane_count_ == kMaxPlanes) {
        ++counters_.plane_overflow;
        continue;
      }
      planes_[++plane_count_] = planes_[source];
      planes_[plane_count_].main_piece = 0;
      planes_[plane_count_].piece_px = 0;
      piece.plane = static_cast<std::uint8_t>(plane_count_);
    }
    Plane& plane = planes_[piece.plane];
    if (plane.main_piece == 0) {
      plane.main_piece = static_cast<std::uint16_t>(k);
      const Vec3 ray = rays_.ray(piece.sum_column / piece.area_px, piece.sum_row / piece.area_px);
      if (plane.plane.inverse_depth(ray) > 1e-3) plane.centre_m = plane.plane.point(ray);
    }
    plane.piece_px += piece.area_px;
  }
  for (std::size_t p = 1; p <= plane_count_; ++p) {
    planes_[p].alive = planes_[p].alive && planes_[p].piece_px >= static_cast<std::uint32_t>(params_.min_surface_px);
    lowest_[p].fill(-1);
    highest_[p].fill(-1);
  }
}

// Where each surface begins and ends in every column.
void SurfaceExtractor::profile_row() noexcept {
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    const std::uint8_t p = plane_at(i, row_);
    if (p == 0) continue;
    const auto c = static_cast<std::size_t>(i);
    if (highest_[p][c] < 0) highest_[p][c] = static_cast<std::int16_t>(row_);
    lowest_[p][c] = static_cast<std::int16_t>(row_);
  }
}

std::uint8_t SurfaceExtractor::plane_at(std::int32_t column, std::int32_t row) const noexcept {
  const std::uint8_t p = pieces_[regions_.labels()(column, row)].plane;
  return planes_[p].alive ? p : std::uint8_t{0};
}

std::size_t SurfaceExtractor::surface_at(std::int32_t column, std::int32_t row) const noexcept {
  return planes_[plane_at(column, row)].surface;
}

// One piece's contour per call; after the last one the outline is closed.
void SurfaceExtractor::outline_piece() noexcept {
  if (!started_) {
    started_ = true;
    repeat_ = 0;
    convex_outline_.begin();
  }
  while (static_cast<std::size_t>(++repeat_) <= regions_.region_count()) {
    const auto k = static_cast<std::size_t>(repeat_);
    if (pieces_[k].plane != index_) continue;
    const RegionLabelling::Region& region = regions_.region(k);
    if (!try_trace_contour(regions_.labels(), static_cast<std::uint16_t>(k), {region.first_column, region.first_row},
                           rays_.width_px, rays_.height_px, contour_)) {
      ++counters_.contour_overflow;
    }
    convex_outline_.add(contour_);
    return;
  }
  convex_outline_.build(kMaxPolygonVertices - 4, outline_);
  started_ = false;
  nosing_ = back_ = occluder_ = EdgeLine{};
  phase_ = planes_[index_].kind == SurfaceKind::kTread ? Phase::kNosing : Phase::kPolygon;
}

// Gathers where the surface ends in each column and what lies beyond; false when there is too little to look for.
bool SurfaceExtractor::begin_line(bool nosing) noexcept {
  constexpr std::int32_t kProbe_px = 4;
  const auto& ends = nosing ? lowest_[index_] : highest_[index_];
  const std::int32_t down = nosing ? 1 : -1;
  std::array<std::int32_t, kMaxPlanes + 1> votes{};
  const auto beyond = [&](std::int32_t column, std::int32_t row) -> std::int32_t {
    // -1: hidden by the body or the picture's end; else the plane beyond, 0 = none.
    std::int32_t found = 0;
    for (std::int32_t k = 1; k <= kProbe_px; ++k) {
      const std::int32_t r = row + down * k;
      if (r < 0 || r >= rays_.height_px || (flags_(column, r) & kPixelBody) != 0) return -1;
      if (found == 0) found = plane_at(column, r);
    }
    return found;
  };
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    const std::int32_t row = ends[static_cast<std::size_t>(i)];
    if (row < 0) continue;
    const std::int32_t p = beyond(i, row);
    if (p > 0) ++votes[static_cast<std::size_t>(p)];
  }
  // The plane beyond: most columns, and on the right side of the surface (a nosing has it below, a back line above).
  // Above, a riser is the back; without one, a higher tread whose nosing hides the rest of this surface.
  const Plane& own = planes_[index_];
  const auto most = [&](bool riser_only) {
    std::size_t other = 0;
    for (std::size_t p = 1; p <= plane_count_; ++p) {
      if (p == index_ || !planes_[p].alive || 2 * votes[p] < params_.edge_lines.min_columns) continue;
      const double height = own.plane.distance_m(planes_[p].centre_m);
      if (nosing ? height > -kStepLeast_m : height < kStepLeast_m) continue;
      if (riser_only && planes_[p].kind != SurfaceKind::kRiser) continue;
      if (other == 0 || votes[p] > votes[other]) other = p;
    }
    return other;
  };
  const std::size_t riser = nosing ? 0 : most(true);
  const std::size_t other = riser != 0 ? riser : most(false);
  if (other == 0) return false;
  line_finder_.begin_guess();
  for (std::int32_t i = 0; i < rays_.width_px; ++i) {
    const std::int32_t row = ends[static_cast<std::size_t>(i)];
    if (row >= 0 && beyond(i, row) == static_cast<std::int32_t>(other)) line_finder_.add_guess(i, row);
  }
  if (!line_finder_.try_guess(params_.edge_lines, static_cast<std::uint32_t>(index_))) {
    ++counters_.rejected_lines;
    return false;
  }
  const EdgeLineFinder::Beyond far_side{planes_[other].plane, planes_[other].covariance};
  line_finder_.begin(params_.edge_lines, params_.noise, raw_, own.plane, &far_side, nosing);
  if (!nosing && riser == 0) {
    occluder_ = line_finder_.guessed_line();
    return false;
  }
  return true;
}

std::int32_t SurfaceExtractor::line_step(bool nosing) noexcept {
  const auto leave = [&] {
    started_ = false;
    phase_ = nosing ? Phase::kBack : Phase::kPolygon;
  };
  if (!started_) {
    if (!begin_line(nosing)) {
      leave();
      return 5;
    }
    started_ = true;
    return 20;
  }
  if (!line_finder_.step(kColumnsPerPiece)) return 12;
  EdgeLine line;
  const EdgeLineFinder::Outcome outcome = line_finder_.finish(line);
  if (outcome == EdgeLineFinder::Outcome::kAgain) return 20;
  counters_.rejected_lines += outcome == EdgeLineFinder::Outcome::kFound ? 0U : 1U;
  (nosing ? nosing_ : back_) = line;
  leave();
  return 20;
}

// What is just outside an edge decides whether the surface ends there or only the view of it.
EdgeKind SurfaceExtractor::judge_edge(const InversePlane& plane, const Vec3& a_m, const Vec3& b_m,
                                      const Vec3& inside_m) const noexcept {
  constexpr int kProbes = 9;
  const Vec3 middle = 0.5 * (a_m + b_m);
  const auto project = [this](const Vec3& p) {
    return Vec2{p.x() / p.z() * rays_.fx_px + rays_.cx_px, p.y() / p.z() * rays_.fy_px + rays_.cy_px};
  };
  const Vec2 a = project(a_m), b = project(b_m), centre = project(inside_m);
  Vec2 outward{(b - a).y(), -(b - a).x()};
  if (outward.norm() < 1e-9) return EdgeKind::kUnknown;
  outward.normalize();
  if (outward.dot(project(middle) - centre) < 0.0) outward = -outward;
  int observed = 0;
  for (int i = 0; i < kProbes; ++i) {
    const Vec2 on = a + (b - a) * ((i + 0.5) / kProbes);
    // The first measured pixel outside, up to twice the probe's distance; the body or the picture's end before it hides
    // the end of the surface.
    const auto reach_px = static_cast<std::int32_t>(1.5 * params_.probe_px);
    for (std::int32_t k = 0; k <= reach_px; ++k) {
      const double out = 0.5 * params_.probe_px + k;
      const Vec2 p = on + out * outward;
      const auto c = static_cast<std::int32_t>(std::floor(p.x() + 0.5)),
                 r = static_cast<std::int32_t>(std::floor(p.y() + 0.5));
      if (c < 0 || c >= rays_.width_px || r < 0 || r >= rays_.height_px || (flags_(c, r) & kPixelBody) != 0) break;
      const double w = static_cast<double>(measured_(c, r));
      if (!(w > 0.0) || out < params_.probe_px) continue;
      const double expected = plane.inverse_depth(rays_.ray(c, r));
      // Something well in front hides it, unless it stands on the surface right here (a riser's foot).
      const bool hidden = expected > 1e-3 && 1.0 / expected - 1.0 / w > params_.apart_m;
      observed += hidden ? 0 : 1;
      break;
    }
  }
  return 2 * observed > kProbes ? EdgeKind::kObserved : EdgeKind::kUnknown;
}

// Over the polygon's rows and columns in the picture.
double SurfaceExtractor::invalid_share(const PolygonVertices& polygon) const noexcept {
  Outline2 seen;
  for (const Vec3& p : polygon) {
    static_cast<void>(
        seen.try_push_back({p.x() / p.z() * rays_.fx_px + rays_.cx_px, p.y() / p.z() * rays_.fy_px + rays_.cy_px}));
  }
  std::int32_t all = 0, invalid = 0;
  double top = 1e9, bottom = -1e9;
  for (const Vec2& p : seen) {
    top = std::min(top, p.y());
    bottom = std::max(bottom, p.y());
  }
  const auto first_row = static_cast<std::int32_t>(math::clamp(std::ceil(top), 0.0, rays_.height_px - 1.0));
  const auto last_row = static_cast<std::int32_t>(math::clamp(std::floor(bottom), 0.0, rays_.height_px - 1.0));
  for (std::int32_t r = first_row; r <= last_row; ++r) {
    double lo = 1e9, hi = -1e9;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Vec2 &a = seen[i], &b = seen[(i + 1) % seen.size()];
      if ((a.y() <= r) == (b.y() <= r)) continue;
      const double x = a.x() + (r - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      lo = std::min(lo, x);
      hi = std::max(hi, x);
    }
    if (hi < lo) continue;
    const auto left = static_cast<std::int32_t>(math::clamp(std::ceil(lo), 0.0, rays_.width_px - 1.0));
    const auto right = static_cast<std::int32_t>(math::clamp(std::floor(hi), 0.0, rays_.width_px - 1.0));
    const std::uint8_t* flags = flags_.row(r);
    for (std::int32_t c = left; c <= right; ++c) {
      if ((flags[c] & kPixelBody) != 0) continue;
      ++all;
      invalid += (flags[c] & kPixelMeasured) == 0 ? 1 : 0;
    }
  }
  return all > 0 ? static_cast<double>(invalid) / all : 0.0;
}

void SurfaceExtractor::build_polygon() noexcept {
  Plane& own = planes_[index_];
  const InversePlane& plane = own.plane;
  const Vec3 n = plane.normal();
  // Plane coordinates with x along the nosing, else along the picture's rows; x cross y = n.
  Vec3 x_axis = Vec3::UnitX();
  if (nosing_.valid) {
    x_axis = nosing_.b_m - nosing_.a_m;
  } else if (back_.valid) {
    x_axis = back_.b_m - back_.a_m;
  }
  x_axis -= n * n.dot(x_axis);
  if (x_axis.norm() < 1e-6) x_axis = n.unitOrthogonal();
  x_axis.normalize();
  const Vec3 y_axis = n.cross(x_axis);
  const Vec3 origin = own.centre_m - n * plane.distance_m(own.centre_m);
  const auto to_plane = [&](const Vec3& p) { return Vec2{(p - origin).dot(x_axis), (p - origin).dot(y_axis)}; };
  const auto to_space = [&](const Vec2& p) { return Vec3{origin + p.x() * x_axis + p.y() * y_axis}; };

  // The picture's outline onto the plane: a projection keeps it convex, and turns clockwise in the picture into
  // clockwise seen from the camera, so the order is reversed.
  Outline2 flat;
  for (std::size_t i = outline_.size(); i-- > 0;) {
    const Vec3 ray = rays_.ray(outline_[i].x(), outline_[i].y());
    if (plane.inverse_depth(ray) > 0.1) static_cast<void>(flat.try_push_back(to_plane(plane.point(ray))));
  }
  const auto drop = [&] {
    own.alive = false;
    ++counters_.no_polygon;
  };
  if (flat.size() < 3 || !(twice_area(flat) > 0.0)) {
    drop();
    return;
  }
  const Vec2 middle = centroid(flat);
  const auto cut = [&](const EdgeLine& line) {
    const Vec2 a = to_plane(line.a_m), b = to_plane(line.b_m);
    Vec2 inward{-(b - a).y(), (b - a).x()};
    inward.normalize();
    if (inward.dot(middle - a) < 0.0) inward = -inward;
    // Corners just short of the line go onto it, those beyond are cut off: either way the edge is the line. Moving only
    // the two extreme ones keeps the outline convex.
    for (Vec2& p : flat) {
      const double distance = inward.dot(p - a);
      if (distance > 0.0 && distance < params_.snap_m) p -= (distance + 1e-6) * inward;
    }
    clip(flat, a, inward);
  };
  if (nosing_.valid) cut(nosing_);
  if (back_.valid) cut(back_);
  if (occluder_.valid) cut(occluder_);
  if (flat.size() >= 3) reduce(flat, kMaxPolygonVertices, 1e-6);
  const double area_m2 = flat.size() >= 3 ? 0.5 * twice_area(flat) : 0.0;
  if (!(area_m2 > 1e-4)) {
    drop();
    return;
  }

  SurfacePatch patch;
  patch.kind = own.kind;
  patch.normal = n;
  patch.d_m = plane.d_m();
  patch.area_m2 = area_m2;
  patch.centroid_m = to_space(centroid(flat));
  patch.rmse_m = math::sqrt(own.residual2 / std::max(own.moments.count, 1.0));
  patch.offset_sigma_m = plane_sigma_m(plane, own.covariance, patch.centroid_m / patch.centroid_m.z());
  const Mat3 across = Mat3::Identity() - n * n.transpose();
  patch.tilt_sigma_rad = patch.d_m * math::sqrt(std::max((across * own.covariance * across).trace(), 0.0));
  patch.nosing = nosing_;
  patch.back = back_;
  // An edge on a nosing or back line is observed if the line was seen along most of it.
  const auto seen_on = [&](const EdgeLine& line, const Vec2& a, const Vec2& b) {
    if (!line.valid) return false;
    const Vec2 p = to_plane(line.a_m), q = to_plane(line.b_m);
    const Vec2 along = (q - p).normalized(), normal{-along.y(), along.x()};
    if (std::abs(normal.dot(a - p)) > kOnLine_m || std::abs(normal.dot(b - p)) > kOnLine_m) return false;
    const double from = std::min(along.dot(a - p), along.dot(b - p)), to = std::max(along.dot(a - p), along.dot(b - p));
    return 2.0 * (std::min(to, (q - p).norm()) - std::max(from, 0.0)) > to - from;
  };
  for (std::size_t i = 0; i < flat.size(); ++i) {
    const Vec2 &a = flat[i], &b = flat[(i + 1) % flat.size()];
    static_cast<void>(patch.polygon.try_push_back(to_space(a)));
    patch.edges[i] = seen_on(nosing_, a, b) || seen_on(back_, a, b)
                         ? EdgeKind::kObserved
                         : judge_edge(plane, to_space(a), to_space(b), patch.centroid_m);
  }
  patch.invalid_fraction = invalid_share(patch.polygon);
  if (!next_.surfaces.try_push_back(patch)) {
    ++next_.dropped;
    ++counters_.plane_overflow;
    own.alive = false;
    return;
  }
  own.surface = static_cast<std::uint8_t>(next_.surfaces.size());
}

void SurfaceExtractor::finish() noexcept {
  next_.invalid_fraction = outside_body_px_ > 0 ? 1.0 - static_cast<double>(measured_px_) / outside_body_px_ : 1.0;
  result_ = next_;
}

}  // namespace polygmap
