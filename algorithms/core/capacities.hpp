// SPDX-License-Identifier: Apache-2.0
// Every size that the module's static memory is made of, in one place.
#pragma once

#include <cstddef>
#include <cstdint>

namespace polygmap {

inline constexpr std::size_t kJointCount = 12;   // 6 per leg, left leg first
inline constexpr std::size_t kJointsPerLeg = 6;  // hip roll, hip yaw, hip pitch, knee, ankle pitch, ankle roll
inline constexpr std::size_t kFootCount = 2;
inline constexpr std::size_t kContactsPerFoot = 4;
inline constexpr std::size_t kContactCount = kFootCount * kContactsPerFoot;

// The largest depth picture: the robot's camera's, unless the build defines another. Widths are multiples of 128, even
// heights: perception works in whole vector registers.
#ifndef POLYGMAP_DEPTH_WIDTH_PX
#define POLYGMAP_DEPTH_WIDTH_PX 640
#define POLYGMAP_DEPTH_HEIGHT_PX 480
#endif
inline constexpr std::int32_t kDepthWidth_px = POLYGMAP_DEPTH_WIDTH_PX;
inline constexpr std::int32_t kDepthHeight_px = POLYGMAP_DEPTH_HEIGHT_PX;

inline constexpr std::size_t kMaxPlanesPerFrame = 64;
inline constexpr std::size_t kMaxPolygonVertices = 24;
inline constexpr std::size_t kMaxMapPolygons = 64;
inline constexpr std::size_t kMaxThingSightings = 64;  // of a frame: columns that show things on its treads
inline constexpr std::size_t kMaxOccupiedCells = 128;  // of 20 mm: as many as a book has that both feet do not pass

inline constexpr std::size_t kStateRingCapacity = 256;  // 0.51 s at 500 Hz: covers LIO and camera delays with margin

inline constexpr std::size_t kFootholdRasterSide_cells = 161;  // 1.6 m square at 10 mm, centred 0.4 m ahead of the base

}  // namespace polygmap
