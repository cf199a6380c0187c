// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/plane_merging.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace polygmap {
namespace {

constexpr double kLeastDeterminant = 1e-13;  // of moments scaled to a trace of 1
constexpr double kBetween = 0.1;             // rad: so far may the plane of two facets lie from between theirs

void redirect(PlaneMerging::PlaneIndex& to_plane, std::size_t from, std::size_t to) noexcept {
  for (std::uint8_t& plane : to_plane) plane = plane == from ? static_cast<std::uint8_t>(to) : plane;
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
[[nodiscard]] bool lies_between(const InversePlane& both, const InversePlane& p, const InversePlane& q) noexcept {
  const Vec3 n = both.normal();
  const double bend = (p.normal() - q.normal()).norm() + kBetween;
  return (n - p.normal()).norm() < bend && (n - q.normal()).norm() < bend;
}

// Seams whose planes are not one, until either plane changes: their lengths are kept below PlaneMerging::kUnlike.
constexpr std::int32_t refused(std::int32_t seam_px) noexcept { return -2 - seam_px; }
constexpr std::int32_t length_of(std::int32_t seam_px) noexcept { return seam_px < -1 ? -2 - seam_px : seam_px; }

// How much the pixels of both planes contradict the plane that fits them together best: chi^2 of the three parameters
// that it has fewer. Neighbouring pixels' errors count once per correlated_px.
[[nodiscard]] bool try_contradiction(const PlaneMerging::Params& params, const DepthSigma& noise, const FramePlane& p,
                                     const FramePlane& q, double& chi2) noexcept {
  PlaneMoments both = p.moments;
  both.add(q.moments);
  Vec3 m;
  if (!try_fit(both, m)) return false;
  if (!lies_between({m}, p.plane, q.plane)) return false;
  chi2 = 0.0;
  for (const FramePlane* plane : {&p, &q}) {
    Vec3 own;
    if (!try_fit(plane->moments, own)) return false;
    const Vec3 off = own - m;
    const double sigma_m = noise.sigma_m(plane->centre_m.z());
    chi2 += off.dot(plane->moments.matrix() * off) * math::square(sigma_m / (sigma_m + params.facet_floor_m)) /
            std::max(noise.correlated_px, 1.0);
  }
  return true;
}

}  // namespace

void PlaneMerging::merge_pieces(const Params& params, const PlaneGrowing::Params& growing, const DepthSigma& noise,
                                FramePlanes& planes, PlaneIndex& to_plane, bool measured) noexcept {
  const double least_cosine = math::cos(params.merge_tilt_rad), least_small = math::cos(2.0 * params.merge_tilt_rad);
  for (std::size_t a = 1; a <= planes.count; ++a) {
    for (std::size_t b = a + 1; b <= planes.count && planes[a].alive; ++b) {
      if (!planes[b].alive || planes[a].facet || planes[b].facet) continue;
      const std::size_t keep = planes[a].pixels >= planes[b].pixels ? a : b, gone = keep == a ? b : a;
      FramePlane &p = planes[keep], &q = planes[gone];
      const bool small = q.pixels < params.small_plane_px;
      if (p.plane.normal().dot(q.plane.normal()) < (small ? least_small : least_cosine)) continue;
      // Where a large plane lies is known well: apart by more than what lets a run join a plane, the two are not one.
      const double noise_m = growing.join_floor_m + growing.join_sigmas * noise.sigma_m(q.centre_m.z());
      const double merge_m = small ? params.merge_m : std::min(noise_m, params.merge_m);
      const double apart_m = std::abs(p.plane.distance_m(q.centre_m));
      const double both_apart_m = small ? apart_m : apart_m + std::abs(q.plane.distance_m(p.centre_m));
      if (both_apart_m > (small || !measured ? 1.0 : 2.0) * merge_m) continue;
      // Once large ones are measured their pixels have the last word: two floors that the camera bends are two.
      double chi2 = 0.0;
      if (!small && measured && (!try_contradiction(params, noise, p, q, chi2) || chi2 > params.pieces_chi2)) continue;
      p.pixels += q.pixels;
      q.alive = false;
      redirect(to_plane, gone, keep);
    }
  }
}

// Spans above or beside one another in the picture.
void PlaneMerging::measure_seams(const SurfaceBoundaries::Columns& columns, std::int32_t column_count,
                                 const FramePlanes& planes, double least_cosine, const PlaneIndex& to_plane) noexcept {
  for (std::size_t a = 0; a <= planes.count; ++a) {
    seam_px_[a][a] = kUnlike;
    for (std::size_t b = a + 1; b <= planes.count; ++b) {
      const bool alike = a > 0 && planes[a].alive && planes[b].alive &&
                         planes[a].plane.normal().dot(planes[b].plane.normal()) >= least_cosine;
      seam_px_[a][b] = alike ? 0 : kUnlike;
    }
  }
  const auto add = [&](std::uint8_t a, std::uint8_t b, std::int32_t length_px) {
    std::int32_t& seam_px = seam_px_[std::min(a, b)][std::max(a, b)];
    if (seam_px != kUnlike) seam_px += length_px;
  };
  for (std::int32_t g = 0; g < column_count; ++g) {
    const SurfaceBoundaries::Column& spans = columns[static_cast<std::size_t>(g)];
    for (std::size_t k = 0; k + 1 < spans.size(); ++k) {
      if (spans[k + 1].top - spans[k].bottom > kMaxGap_px) continue;
      add(to_plane[spans[k].plane], to_plane[spans[k + 1].plane], kColumn_px);
    }
    if (g + 1 == column_count) break;
    const SurfaceBoundaries::Column& right = columns[static_cast<std::size_t>(g + 1)];
    for (std::size_t k = 0, i = 0; k < spans.size() && i < right.size();) {  // both from top to bottom
      const std::int32_t shared = std::min(spans[k].bottom, right[i].bottom) - std::max(spans[k].top, right[i].top) + 1;
      if (shared > 0) add(to_plane[spans[k].plane], to_plane[right[i].plane], shared);
      ++(spans[k].bottom < right[i].bottom ? k : i);
    }
  }
}

void PlaneMerging::join_facets(const Params& params, const PlaneGrowing::Params& growing, const DepthSigma& noise,
                               const SurfaceBoundaries::Columns& columns, std::int32_t column_count,
                               FramePlanes& planes, PlaneIndex& to_plane) noexcept {
  measure_seams(columns, column_count, planes, math::cos(params.facet_tilt_rad), to_plane);
  for (std::size_t joined = 0; joined < kMaxFacets; ++joined) {
    double least = params.facet_chi2;
    std::size_t best_a = 0, best_b = 0;
    for (std::size_t a = 1; a <= planes.count; ++a) {
      for (std::size_t b = a + 1; b <= planes.count; ++b) {
        if (seam_px_[a][b] <= 0) continue;
        const FramePlane &p = planes[a], &q = planes[b];
        if (seam_px_[a][b] < params.facet_seam * math::sqrt(std::min(p.pixels, q.pixels))) continue;
        double chi2 = 0.0;
        if (!try_contradiction(params, noise, p, q, chi2) || !(chi2 < params.facet_chi2)) {
          seam_px_[a][b] = refused(seam_px_[a][b]);
          continue;
        }
        if (!(chi2 < least)) continue;
        least = chi2;
        best_a = a;
        best_b = b;
      }
    }
    if (best_a == 0) return;
    FramePlane &p = planes[best_a], &q = planes[best_b];
    p.moments.add(q.moments);
    if (!try_fit(p.moments, p.plane.m)) return;
    p.pixels += q.pixels;
    p.facet = p.facet && q.facet && p.pixels < growing.min_plane_px;
    p.residual2 += q.residual2;
    p.centre_m = p.plane.point(p.moments.mean_ray());
    p.facets = static_cast<std::uint8_t>(std::min(p.facets + q.facets, 255));
    q.alive = false;
    redirect(to_plane, best_b, best_a);
    const auto seam = [this](std::size_t a, std::size_t b) -> std::int32_t& {
      return seam_px_[std::min(a, b)][std::max(a, b)];
    };
    for (std::size_t c = 1; c <= planes.count; ++c) {  // what the one touches, both do, and are asked again
      if (c == best_a || c == best_b) continue;
      std::int32_t &both = seam(best_a, c), &gone = seam(best_b, c);
      if (both != kUnlike) both = length_of(both) + std::max(length_of(gone), 0);
      gone = kUnlike;
    }
    seam(best_a, best_b) = kUnlike;
  }
}

}  // namespace polygmap
