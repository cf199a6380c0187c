// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/plane_merging.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

namespace polygmap {
namespace {

constexpr double kLeastDeterminant = 1e-13;  // of moments scaled to a trace of 1

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

// How much the pixels of both planes contradict the plane that fits them together best: chi^2 of the three parameters
// that it has fewer. Neighbouring pixels' errors count once per correlated_px.
[[nodiscard]] bool try_contradiction(const PlaneMerging::Params& params, const DepthSigma& noise, const FramePlane& p,
                                     const FramePlane& q, double& chi2) noexcept {
  PlaneMoments both = p.moments;
  both.add(q.moments);
  Vec3 m;
  if (!try_fit(both, m)) return false;
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
                                FramePlanes& planes, PlaneIndex& to_plane) noexcept {
  const double least_cosine = math::cos(params.merge_tilt_rad), least_small = math::cos(2.0 * params.merge_tilt_rad);
  for (std::size_t a = 1; a <= planes.count; ++a) {
    for (std::size_t b = a + 1; b <= planes.count && planes[a].alive; ++b) {
      if (!planes[b].alive) continue;
      const std::size_t keep = planes[a].pixels >= planes[b].pixels ? a : b, gone = keep == a ? b : a;
      FramePlane &p = planes[keep], &q = planes[gone];
      const bool small = q.pixels < params.small_plane_px;
      if (p.plane.normal().dot(q.plane.normal()) < (small ? least_small : least_cosine)) continue;
      // Where a large plane lies is known well: apart by more than what lets a run join a plane, the two are not one.
      const double noise_m = growing.join_floor_m + growing.join_sigmas * noise.sigma_m(q.centre_m.z());
      const double merge_m = small ? params.merge_m : std::min(noise_m, params.merge_m);
      const double apart_m = std::abs(p.plane.distance_m(q.centre_m));
      if (small ? apart_m > merge_m : apart_m + std::abs(q.plane.distance_m(p.centre_m)) > 2.0 * merge_m) continue;
      p.pixels += q.pixels;
      q.alive = false;
      redirect(to_plane, gone, keep);
    }
  }
}

// Planes that lie above or beside one another in the picture and face nearly the same way, and along how many pixels.
void PlaneMerging::measure_seams(const SurfaceBoundaries::Columns& columns, std::int32_t column_count,
                                 const FramePlanes& planes, double least_cosine, const PlaneIndex& to_plane) noexcept {
  seams_.clear();
  // Most neighbours are the same pair as the one before.
  std::uint8_t last_a = 0, last_b = 0;
  PlaneSeam* last = nullptr;
  const auto add = [&](std::uint8_t a, std::uint8_t b, std::int32_t length_px) {
    if (a > b) std::swap(a, b);
    if (a != last_a || b != last_b) {
      last_a = a;
      last_b = b;
      last = std::find_if(seams_.begin(), seams_.end(), [&](const PlaneSeam& s) { return s.a == a && s.b == b; });
      if (last == seams_.end()) {
        last = nullptr;
        const bool alike = planes[a].alive && planes[b].alive &&
                           planes[a].plane.normal().dot(planes[b].plane.normal()) >= least_cosine;
        if (alike && seams_.try_push_back({a, b, 0})) last = &seams_.back();
      }
    }
    if (last != nullptr) last->length_px += length_px;
  };
  for (std::int32_t g = 0; g < column_count; ++g) {
    const SurfaceBoundaries::Column& spans = columns[static_cast<std::size_t>(g)];
    for (std::size_t k = 0; k + 1 < spans.size(); ++k) {
      const std::uint8_t a = to_plane[spans[k].plane], b = to_plane[spans[k + 1].plane];
      if (a != b && a != 0 && b != 0 && spans[k + 1].top - spans[k].bottom <= kMaxGap_px) add(a, b, kColumn_px);
    }
    if (g + 1 == column_count) break;
    const SurfaceBoundaries::Column& right = columns[static_cast<std::size_t>(g + 1)];
    for (std::size_t k = 0, i = 0; k < spans.size() && i < right.size();) {  // both from top to bottom
      const std::int32_t shared =
          std::min(spans[k].bottom, right[i].bottom) - std::max(spans[k].top, right[i].top) + 1;
      const std::uint8_t a = to_plane[spans[k].plane], b = to_plane[right[i].plane];
      if (shared > 0 && a != b && a != 0 && b != 0) add(a, b, shared);
      ++(spans[k].bottom < right[i].bottom ? k : i);
    }
  }
}

void PlaneMerging::join_facets(const Params& params, const DepthSigma& noise,
                               const SurfaceBoundaries::Columns& columns, std::int32_t column_count,
                               FramePlanes& planes, PlaneIndex& to_plane) noexcept {
  const double least_cosine = math::cos(params.facet_tilt_rad);
  for (std::size_t joined = 0; joined < kMaxFacets; ++joined) {
    measure_seams(columns, column_count, planes, least_cosine, to_plane);
    double least = params.facet_chi2;
    const PlaneSeam* best = nullptr;
    for (const PlaneSeam& seam : seams_) {
      const FramePlane &p = planes[seam.a], &q = planes[seam.b];
      const double smaller_px = std::min(p.pixels, q.pixels);
      if (seam.length_px < params.facet_seam * math::sqrt(smaller_px)) continue;
      double chi2 = 0.0;
      if (!try_contradiction(params, noise, p, q, chi2) || !(chi2 < least)) continue;
      least = chi2;
      best = &seam;
    }
    if (best == nullptr) return;
    FramePlane &p = planes[best->a], &q = planes[best->b];
    PlaneMoments both = p.moments;
    both.add(q.moments);
    if (!try_fit(both, p.plane.m)) return;
    p.moments = both;
    p.pixels += q.pixels;
    p.residual2 += q.residual2;
    p.centre_m = p.plane.point(both.mean_ray());
    p.facets = static_cast<std::uint8_t>(std::min(p.facets + q.facets, 255));
    q.alive = false;
    redirect(to_plane, best->b, best->a);
  }
}

}  // namespace polygmap
