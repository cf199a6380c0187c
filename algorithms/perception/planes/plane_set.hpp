// SPDX-License-Identifier: Apache-2.0
// The planes of one frame as they were fitted.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/perception/planes/plane_fit.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {

struct FittedPlane {
  InversePlane plane;
  SurfaceKind kind = SurfaceKind::kOther;
  Vec3 centre_m = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  // of plane.m
  PlaneMoments moments;            // of the fitted pixels
  double residual2 = 0.0;          // sum of their squared normal distances
  double pixels = 0.0;
  bool alive = false;
  bool facet = false;       // too small to be a plane by itself
  bool merged = false;      // with a coplanar one, and not solved since
  std::uint8_t facets = 1;  // planes that were joined into this one
  bool low_parts = false;   // some of them are too low in the picture to say how they lean
};

struct PlaneSet {
  static constexpr std::size_t kMaxPlanes = SpanBoundaries::kMaxPlanes;
  std::array<FittedPlane, kMaxPlanes + 1> planes;  // by PlaneId; [kNoPlane] is never alive
  PlaneId count = 0;

  [[nodiscard]] FittedPlane& operator[](std::size_t i) noexcept { return planes[i]; }
  [[nodiscard]] const FittedPlane& operator[](std::size_t i) const noexcept { return planes[i]; }
};

}  // namespace polygmap
