// SPDX-License-Identifier: Apache-2.0
// Convex outlines with a bounded number of corners.
#pragma once

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/math/math.hpp"

namespace polygmap {

inline constexpr std::size_t kMaxOutline = 64;
using Outline2 = StaticVector<Vec2, kMaxOutline>;  // convex, in any plane coordinates

// Twice the signed area; positive when the vertices turn counter-clockwise in a right-handed plane.
[[nodiscard]] double twice_area(const Outline2& outline) noexcept;
[[nodiscard]] Vec2 centroid(const Outline2& outline) noexcept;
// Keeps the part with normal . (p - point) >= 0. Order is kept. At most one vertex is added.
void clip(Outline2& outline, const Vec2& point, const Vec2& normal) noexcept;
// Drops vertices until at most count are left, the least triangle first: the outline only shrinks.
void reduce(Outline2& outline, std::size_t count, double min_area) noexcept;

}  // namespace polygmap
