// SPDX-License-Identifier: Apache-2.0
// What perception sees in one frame and what the map remembers.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/math/math.hpp"
#include "algorithms/core/messages/ground_view.hpp"

namespace polygmap {

enum class SurfaceKind : std::uint8_t { kTread, kRiser, kOther };  // level, upright, neither (by gravity)

// What ends a polygon at an edge: only an observed end is evidence about the surface's size.
enum class EdgeKind : std::uint8_t {
  kObserved,  // the surface ends here (a nosing, a riser's foot, a side)
  kUnknown,   // the picture ends here, or the robot's own leg, or a hole in the data
};

// Two points on a straight edge, with the standard deviation across it (map: against the robot).
struct EdgeLine {
  Vec3 a_m = Vec3::Zero();
  Vec3 b_m = Vec3::Zero();
  double sigma_m = 0.0;
  bool valid = false;
};

using PolygonVertices = StaticVector<Vec3, kMaxPolygonVertices>;

// One planar surface; in the camera frame when it comes from a frame, in odometry in the map.
struct SurfacePatch {
  SurfaceKind kind = SurfaceKind::kOther;
  Vec3 normal = Vec3::UnitZ();  // unit, towards the viewer (map: out of the surface)
  double d_m = 0.0;             // normal . p + d = 0
  double offset_sigma_m = 0.0;  // along the normal, at the centroid (map: against the robot)
  double tilt_sigma_rad = 0.0;
  Vec3 centroid_m = Vec3::Zero();
  double area_m2 = 0.0;
  double rmse_m = 0.0;
  double invalid_fraction = 0.0;  // of the pixels inside the polygon
  PolygonVertices polygon;        // convex, on the plane, counter-clockwise seen against the normal (from outside)
  std::array<EdgeKind, kMaxPolygonVertices> edges{};  // edge i: vertex i to i + 1
  Mat3 covariance = Mat3::Zero();                     // of m = -normal / d, 1/m; in a frame only
  std::uint8_t plane = 0;                             // surfaces cut from one plane share its number; in a frame only
  EdgeLine nosing;          // treads: the front edge where the surface drops away towards the viewer
  EdgeLine back;            // treads: the far edge, where the next riser starts or,
  bool back_drops = false;  // where this is set, a lower surface lies beyond
};

using SurfacePatches = StaticVector<SurfacePatch, kMaxPlanesPerFrame>;

// What one of the picture's columns shows of something that lies on a tread: below it, on the tread's plane, from its
// nearest to its farthest row. Camera frame.
struct ThingSighting {
  Vec3 near_m = Vec3::Zero();
  Vec3 far_m = Vec3::Zero();
  double height_m = 0.0;  // above the tread, at most
};
using ThingSightings = StaticVector<ThingSighting, kMaxThingSightings>;

// Everything seen in one frame.
struct SurfaceFrame {
  std::int64_t stamp_ns = 0;  // exposure
  std::uint32_t sequence = 0;
  SurfacePatches surfaces;        // camera frame
  ThingSightings things;          // on its treads
  double invalid_fraction = 0.0;  // of the picture outside the robot's own body
  std::uint32_t dropped = 0;      // surfaces that found no room
};

// One remembered surface, in odometry.
struct MapPolygon {
  SurfacePatch surface;
  std::uint32_t id = 0;           // never reused
  std::uint32_t sightings = 0;    // frames fused
  std::int64_t last_seen_ns = 0;  // exposure stamp
};
using MapPolygons = StaticVector<MapPolygon, kMaxMapPolygons>;

// A square of ground that something lies on, kOccupiedCell_m wide and along the map's axes; the map's frame.
struct OccupiedCell {
  double x_m = 0.0, y_m = 0.0;  // its middle
  double ground_m = 0.0;        // height of the tread there
  double height_m = 0.0;        // of the thing above it
};
using OccupiedCells = StaticVector<OccupiedCell, kMaxOccupiedCells>;
inline constexpr double kOccupiedCell_m = 0.02;

struct MapSnapshot {
  std::int64_t stamp_ns = 0;    // exposure of the newest fused frame
  Vec3 drift_m = Vec3::Zero();  // what lies at p in the map lies at p + drift in the pose's odometry
  MapPolygons polygons;
  OccupiedCells occupied;
  GroundView ground;  // along the map's axes
};

}  // namespace polygmap
