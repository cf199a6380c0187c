// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/plane_merging.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace polygmap {
namespace {

constexpr std::int32_t kContradictionInstructions = 1100;
constexpr double kLeastDeterminant = 1e-13;  // of moments scaled to a trace of 1

void redirect(PlaneMerging::PlaneIndex& to_plane, std::size_t from, std::size_t to) noexcept {
  for (PlaneId& plane : to_plane) plane = plane == from ? static_cast<PlaneId>(to) : plane;
}

[[nodiscard]] bool try_fit(const PlaneMoments& moments, Vec3& m) noexcept {
  const Mat3 a = moments.matrix();
  const double scale = a.trace();
  if (!(scale > 0.0) || !((a / scale).determinant() > kLeastDeterminant)) return false;
  m = (a / scale).inverse() * moments.vector() / scale;
  return math::all_finite(m);
}

// The plane through a bend lies between its facets. That through a step leans against both: an overhanging nosing's
// face and the foot of the riser behind it are no ramp.
[[nodiscard]] bool lies_between(const PlaneMerging::Params& params, const InversePlane& both, const InversePlane& p,
                                const InversePlane& q) noexcept {
  const Vec3 n = both.normal();
  const double bend = (p.normal() - q.normal()).norm() + params.between_rad;
  return (n - p.normal()).norm() < bend && (n - q.normal()).norm() < bend;
}

// How much the pixels of both planes contradict the plane that fits them together best: chi^2 of the three parameters
// that it has fewer. Neighbouring pixels' errors count once per correlated_px.
[[nodiscard]] bool try_contradiction(const PlaneMerging::Params& params, const DepthNoiseModel& noise,
                                     const FittedPlane& p, const FittedPlane& q, double& chi2) noexcept {
  PlaneMoments both = p.moments;
  both.add(q.moments);
  Vec3 m;
  if (!try_fit(both, m)) return false;
  if (!lies_between(params, {m}, p.plane, q.plane)) return false;
  chi2 = 0.0;
  for (const FittedPlane* plane : {&p, &q}) {
    Vec3 own;
    if (!try_fit(plane->moments, own)) return false;
    const Vec3 off = own - m;
    const double sigma_m = noise.sigma_m(plane->centre_m.z());
    chi2 += off.dot(plane->moments.matrix() * off) * math::square(sigma_m / (sigma_m + params.facet_floor_m)) /
            std::max(noise.correlated_px, 1.0);
  }
  return true;
}

void take_over(FittedPlane& kept, FittedPlane& gone) noexcept {
  kept.pixels += gone.pixels;
  kept.moments.add(gone.moments);
  kept.merged = true;
  gone.alive = false;
  Vec3 m;
  if (try_fit(kept.moments, m)) kept.plane.m = m;
}

}  // namespace

// Whether a plane is part of one with as many pixels or more; cosine: of the angle between them.
bool PlaneMerging::part_of(const FittedPlane& p, const FittedPlane& q, double cosine) noexcept {
  const bool small = q.pixels < params_.small_plane_px;
  if (!small && cosine < math::cos(params_.merge_tilt_rad)) return false;
  // Where a large plane lies is known well: apart by more than what lets a segment join a plane, the two are not one.
  const double noise_m = growing_.join_floor_m + growing_.join_sigmas * noise_.sigma_m(q.centre_m.z());
  const double merge_m = small ? params_.merge_m : std::min(noise_m, params_.merge_m);
  const double apart_m = std::abs(p.plane.distance_m(q.centre_m));
  const double both_apart_m = small ? apart_m : apart_m + std::abs(q.plane.distance_m(p.centre_m));
  if (both_apart_m > (small || !measured_ ? 1.0 : 2.0) * merge_m) return false;
  if (small || !measured_) return true;
  work_.add(kContradictionInstructions);
  // Once large ones are measured their pixels have the last word: two floors that the camera bends are two.
  double chi2 = 0.0;
  return try_contradiction(params_, noise_, p, q, chi2) && !(chi2 > params_.apart_chi2);
}

void PlaneMerging::begin_coplanar(const Params& params, const PlaneGrowing::Params& growing,
                                  const DepthNoiseModel& noise, const PlaneSet& planes, bool measured) noexcept {
  params_ = params;
  growing_ = growing;
  noise_ = noise;
  measured_ = measured;
  candidates_.clear();
  for (std::size_t p = 1; p <= planes.count; ++p) {
    if (planes[p].alive && !planes[p].facet) {
      static_cast<void>(candidates_.try_push_back({planes[p].plane.normal(), p}));
    }
  }
  first_ = 0;
  second_ = 1;
  work_.add(planes.count, 75);
}

bool PlaneMerging::merge_some(PlaneSet& planes, PlaneIndex& to_plane) noexcept {
  constexpr std::int32_t kPieceInstructions = 6000;
  const std::int32_t enough = work_.instructions() + kPieceInstructions;
  const double least_cosine = math::cos(2.0 * params_.merge_tilt_rad);
  work_.add(120);
  while (work_.instructions() < enough) {
    if (first_ == candidates_.size()) return true;
    const std::size_t a = candidates_[first_].plane;
    if (second_ >= candidates_.size() || !planes[a].alive) {
      ++first_;
      second_ = first_ + 1;
      work_.add(12);
      continue;
    }
    work_.add(24);
    const double cosine = candidates_[first_].normal.dot(candidates_[second_].normal);
    const std::size_t b = candidates_[second_++].plane;
    if (cosine < least_cosine || !planes[b].alive) continue;
    const std::size_t keep = planes[a].pixels >= planes[b].pixels ? a : b, gone = keep == a ? b : a;
    work_.add(170);
    if (!part_of(planes[keep], planes[gone], cosine)) continue;
    take_over(planes[keep], planes[gone]);
    redirect(to_plane, gone, keep);
    work_.add(650);
  }
  return false;
}

void PlaneMerging::begin_facets(const Params& params, const PlaneGrowing::Params& growing, const DepthNoiseModel& noise,
                                const PlaneSet& planes) noexcept {
  params_ = params;
  growing_ = growing;
  noise_ = noise;
  least_cosine_ = math::cos(params.facet_tilt_rad);
  normals_[0] = Vec3::Zero();
  for (std::size_t p = 1; p <= planes.count; ++p) {
    normals_[p] = planes[p].alive ? planes[p].plane.normal() : Vec3{Vec3::Zero()};
  }
  for (std::size_t p = 0; p <= planes.count; ++p) seam_of_[p].fill(0);
  spans_of_.fill(0);
  seam_count_ = joined_ = 0;
  next_open_ = 1;
  overflow_ = 0;
  work_.add(300 + planes.count * (60 + planes.count / 8));
}

void PlaneMerging::touch(std::uint8_t a, std::uint8_t b, std::int32_t length_px, bool beside) noexcept {
  if (a == b) return;
  SeamIndex& seam = seam_of(a, b);
  if (seam == 0) {
    if (!alike(a, b)) return;
    if (seam_count_ == kMaxSeams) {
      ++overflow_;
      return;
    }
    seam = static_cast<SeamIndex>(++seam_count_);
    seams_[seam] = Seam{};
    seams_[seam].a = std::min(a, b);
    seams_[seam].b = std::max(a, b);
  }
  seams_[seam].length_px += length_px;
  seams_[seam].beside_px += beside ? length_px : 0;
}

// Spans above or beside one another in the picture.
void PlaneMerging::add_column(const SpanBoundaries::Column& spans, const SpanBoundaries::Column* right,
                              const PlaneIndex& to_plane) noexcept {
  work_.add(110);
  work_.add(spans.size() + (right != nullptr ? right->size() : 0), 54);
  for (const ColumnSpan& span : spans) ++spans_of_[to_plane[span.plane]];
  for (std::size_t k = 0; k + 1 < spans.size(); ++k) {
    if (spans[k + 1].top - spans[k].bottom > kMaxGap_px) continue;
    touch(to_plane[spans[k].plane], to_plane[spans[k + 1].plane], kColumn_px, false);
  }
  if (right == nullptr) return;
  for (std::size_t k = 0, i = 0; k < spans.size() && i < right->size();) {  // both from top to bottom
    const ColumnSpan &here = spans[k], &there = (*right)[i];
    const std::int32_t shared = std::min(here.bottom, there.bottom) - std::max(here.top, there.top) + 1;
    if (shared > 0) touch(to_plane[here.plane], to_plane[there.plane], shared, true);
    ++(here.bottom < there.bottom ? k : i);
  }
}

void PlaneMerging::judge(const PlaneSet& planes, Seam& seam) noexcept {
  work_.add(70);
  const FittedPlane &p = planes[seam.a], &q = planes[seam.b];
  const auto height_px = [&](std::size_t i) { return planes[i].pixels / (kColumn_px * std::max(spans_of_[i], 1)); };
  const bool steps = p.kind == q.kind && p.kind != SurfaceKind::kOther;
  seam.low = seam.length_px < params_.facet_seam * math::sqrt(std::min(p.pixels, q.pixels));
  if (seam.low && !(steps && seam.beside_px >= params_.facet_seam * std::min(height_px(seam.a), height_px(seam.b)))) {
    seam.verdict = Seam::Verdict::kShort;
  } else {
    work_.add(kContradictionInstructions);
    const bool one = try_contradiction(params_, noise_, p, q, seam.chi2) && seam.chi2 < params_.facet_chi2;
    seam.verdict = one ? Seam::Verdict::kOne : Seam::Verdict::kContradicted;
  }
}

bool PlaneMerging::try_join(PlaneSet& planes, PlaneIndex& to_plane, Seam& best) noexcept {
  const std::size_t kept = best.a, gone = best.b;
  work_.add(600);
  work_.add(seam_count_, 14);
  FittedPlane &p = planes[kept], &q = planes[gone];
  p.moments.add(q.moments);
  if (!try_fit(p.moments, p.plane.m)) return false;
  p.pixels += q.pixels;
  spans_of_[kept] += spans_of_[gone];
  p.facet = p.facet && q.facet && p.pixels < growing_.min_plane_px;
  p.residual2 += q.residual2;
  p.centre_m = p.plane.point(p.moments.mean_ray());
  p.low_parts = p.low_parts || q.low_parts || best.low;
  p.facets = static_cast<std::uint8_t>(std::min(p.facets + q.facets, 255));
  q.alive = false;
  redirect(to_plane, gone, kept);
  best.verdict = Seam::Verdict::kGone;
  for (std::size_t i = 1; i <= seam_count_; ++i) {  // what the one touches, both do, and are asked again
    Seam& seam = seams_[i];
    if (seam.verdict == Seam::Verdict::kGone) continue;
    if (seam.a == kept || seam.b == kept) seam.verdict = Seam::Verdict::kOpen;
    if (seam.a != gone && seam.b != gone) continue;
    const std::size_t other = seam.a == gone ? seam.b : seam.a;
    const bool counts = alike(kept, other);
    SeamIndex& both = seam_of(kept, other);
    if (both != 0) {
      if (counts) {
        seams_[both].length_px += seam.length_px;
        seams_[both].beside_px += seam.beside_px;
      }
      seam.verdict = Seam::Verdict::kGone;
    } else if (counts) {
      both = static_cast<SeamIndex>(i);
      seam.a = static_cast<std::uint8_t>(std::min(kept, other));
      seam.b = static_cast<std::uint8_t>(std::max(kept, other));
      seam.verdict = Seam::Verdict::kOpen;
    } else {
      seam.verdict = Seam::Verdict::kGone;
    }
  }
  next_open_ = 1;
  return true;
}

bool PlaneMerging::join_some(PlaneSet& planes, PlaneIndex& to_plane) noexcept {
  std::size_t looked_at = 0;
  work_.add(40);
  work_.add(seam_count_, 10);
  for (; next_open_ <= seam_count_ && looked_at < kSeamsAtOnce; ++next_open_) {
    if (seams_[next_open_].verdict != Seam::Verdict::kOpen) continue;
    judge(planes, seams_[next_open_]);
    ++looked_at;
  }
  if (next_open_ <= seam_count_) return false;
  Seam* best = nullptr;
  for (std::size_t i = 1; i <= seam_count_; ++i) {
    Seam& seam = seams_[i];
    if (seam.verdict == Seam::Verdict::kOne && (best == nullptr || seam.chi2 < best->chi2)) best = &seam;
  }
  return best == nullptr || !try_join(planes, to_plane, *best) || ++joined_ == kMaxFacets;
}

}  // namespace polygmap
