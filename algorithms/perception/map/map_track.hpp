// SPDX-License-Identifier: Apache-2.0
// What the polygon map keeps about one surface.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/geometry/convex.hpp"
#include "algorithms/geometry/plane.hpp"

namespace polygmap {

inline constexpr std::size_t kMapSides = 8;  // side k looks along k * 45 degrees from the local x axis
inline constexpr std::size_t kLeftSide = 2, kRightSide = 6;
// Of a polygon's edges; tags below are those of sides.
inline constexpr std::uint8_t kNosingTag = 8;
inline constexpr std::uint8_t kBackTag = 9;
[[nodiscard]] inline Vec2 side_direction(std::size_t side) noexcept {
  return unit_at(static_cast<double>(side) * (kPi / 4.0));
}
[[nodiscard]] inline Vec2 local_xy(const Transform& map_T_local, const Vec3& map_m) noexcept {
  return (map_T_local.R.transpose() * (map_m - map_T_local.p_m)).head<2>();
}
// A right-handed frame with z along the unit normal and x as near to the given direction as that allows.
[[nodiscard]] Mat3 frame_from(const Vec3& normal, const Vec3& x_hint) noexcept;
struct SeenEndParams {
  double tolerance_m = 0.015;
  double min_length_m = 0.02;

  static void visit(auto& p, auto& field) {
    field("tolerance_m", p.tolerance_m, 0.0, 0.2, "Edges as near to the farthest vertex make up a surface's end.");
    field("min_length_m", p.min_length_m, 0.0, 0.5,
          "A shorter end is a corner: both its edges say whether it was seen.");
  }
};
// Is the farthest end of the polygon in direction u one that was really seen to end? The edges along that end decide;
// a mere corner counts when both its edges were seen. support: of the polygon in that direction.
[[nodiscard]] bool end_observed(const SeenEndParams& params, const ConvexPolygon& polygon,
                                const std::array<EdgeKind, kMaxPolygonVertices>& edges, const Vec2& u,
                                double support) noexcept;

// Where the camera was at the last sighting, and how well its mount was known then.
struct Viewpoint {
  Vec3 map_p_camera_m = Vec3::Zero();
  double mount_sigma_rad = 0.0;
};
// A seen line, local coordinates.
struct SeenLine {
  Vec2 a_m, b_m;
  double variance_m2;
};
// x = offset + slope * y in local coordinates, with the 2x2 information of (offset, slope).
struct TrackedLine {
  Vec2 state = Vec2::Zero();
  Mat2 information = Mat2::Zero();
  std::int64_t seen_ns = 0;
  Viewpoint seen_from;
  std::uint32_t sightings = 0;
  std::uint32_t outliers = 0;
  [[nodiscard]] double at_m(double y_m) const noexcept { return state[0] + state[1] * y_m; }
  [[nodiscard]] double variance_m2(double y_m) const noexcept;
};
struct TrackedSide {
  double support_m = 0.0;
  double reach_m = 0.0;  // of the last sighting: one frame alone does not make an unknown end grow
  double information = 0.0;
  std::int64_t seen_ns = 0;
  std::optional<double> outlier_m;  // where the last sighting had an end that contradicts it
  std::uint32_t outliers = 0;
  bool observed = false;
};
// A surface of the frame, in the map.
struct SeenSurface {
  SurfaceKind kind = SurfaceKind::kOther;
  Plane plane;
  Vec3 centroid_m = Vec3::Zero();
  double offset_variance_m2 = 0.0;
  double tilt_variance_rad2 = 0.0;
  double pose_variance_m2 = 0.0;
  double rmse_m = 0.0;
  double invalid_fraction = 0.0;
  PolygonVertices polygon;
  std::array<EdgeKind, kMaxPolygonVertices> edges{};
  EdgeLine nosing;
  EdgeLine back;
  bool back_drops = false;
};
struct MapTrack {
  std::uint32_t id = 0;
  SurfaceKind kind = SurfaceKind::kOther;
  std::uint32_t sightings = 0;
  std::uint32_t misses = 0;
  struct {
    std::uint32_t planes = 0;  // consecutive sightings of its plane elsewhere
    std::uint32_t fronts = 0;  // of its lines, as many that face another way since one faced this way
  } outliers;
  std::int64_t last_seen_ns = 0;
  Viewpoint seen_from;
  Transform map_T_local;  // z out of the surface; level: x up the stairs, y left; upright: y up
  double offset_information = 0.0;
  double tilt_information = 0.0;
  double rmse_m = 0.0;
  double invalid_fraction = 0.0;
  std::array<TrackedSide, kMapSides> sides{};
  TrackedLine nosing;
  TrackedLine back;
  std::int32_t back_drops = 0;  // sightings of the back line that say so, less those that do not
  ConvexPolygon polygon;        // local
  EdgeTags tags{};
  bool dirty = false;
  bool erased = false;
};

}  // namespace polygmap
