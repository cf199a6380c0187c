// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/geometry/convex.hpp"
#include "algorithms/geometry/oriented_rectangle.hpp"
#include "algorithms/geometry/plane.hpp"

namespace polygmap {
namespace {

using Uniform = std::uniform_real_distribution<>;

ConvexPolygon square(double half_m) {
  ConvexPolygon p;
  for (const Vec2& v : {Vec2{-half_m, -half_m}, {half_m, -half_m}, {half_m, half_m}, {-half_m, half_m}}) {
    EXPECT_TRUE(p.try_push_back(v));
  }
  return p;
}

ConvexPolygon random_points(std::mt19937& random, std::size_t count) {
  ConvexPolygon points;
  Uniform coordinate(-1, 1);
  for (std::size_t i = 0; i < count; ++i) EXPECT_TRUE(points.try_push_back({coordinate(random), coordinate(random)}));
  return points;
}

OrientedRectangle random_rectangle(std::mt19937& random) {
  return {{Uniform(-0.5, 0.5)(random), Uniform(-0.5, 0.5)(random)},
          Uniform(0.02, 0.3)(random),
          Uniform(0.02, 0.3)(random),
          Uniform(-kPi, kPi)(random)};
}

ConvexPolygon corners(const OrientedRectangle& r) {
  const Vec2 along = r.half_length_m * unit_at(r.yaw_rad), across = r.half_width_m * left_of(unit_at(r.yaw_rad));
  ConvexPolygon out;
  for (const Vec2& v : {Vec2{along - across}, Vec2{along + across}, Vec2{across - along}, Vec2{-along - across}}) {
    EXPECT_TRUE(out.try_push_back(r.centre_m + v));
  }
  return out;
}

// Oracle: a directed pair of points is a hull edge when no point lies to its right.
std::size_t brute_force_hull_size(const ConvexPolygon& points) {
  std::size_t edges = 0;
  for (const Vec2& a : points) {
    for (const Vec2& b : points) {
      if (&a == &b) continue;
      bool all_left = true;
      for (const Vec2& c : points) all_left = all_left && (&c == &a || &c == &b || cross(b - a, c - a) > 0);
      edges += all_left ? 1U : 0U;
    }
  }
  return edges;
}

TEST(RotationZyx, RandomAngles_IsTheProductOfThree) {
  std::mt19937 random(4);
  Uniform angle(-4.0, 4.0);
  for (int i = 0; i < 1000; ++i) {
    const double yaw = angle(random), pitch = angle(random), roll = angle(random);
    const Mat3 product = rotation_z(yaw) * rotation_y(pitch) * rotation_x(roll);
    EXPECT_LT((rotation_zyx(yaw, pitch, roll) - product).cwiseAbs().maxCoeff(), 1e-15);
  }
}

TEST(ConvexHullEq15, RandomPoints_AgainstBruteForce_SameEdgesAndAllInside) {
  std::mt19937 random(15);
  for (int trial = 0; trial < 300; ++trial) {
    const ConvexPolygon points = random_points(random, 3 + static_cast<std::size_t>(trial) % 30);
    const ConvexPolygon hull = convex_hull(points);
    EXPECT_EQ(hull.size(), brute_force_hull_size(points));
    EXPECT_GT(area_m2(hull), 0.0);
    for (const Vec2& p : points) EXPECT_GT(signed_distance_m(hull, p), -1e-12);
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const Vec2 a = hull[i], b = hull[(i + 1) % hull.size()], c = hull[(i + 2) % hull.size()];
      EXPECT_GT(cross(b - a, c - b), 0.0);
    }
  }
}

TEST(ConvexHullEq15, CollinearAndCoincidentPoints_DropOut) {
  ConvexPolygon points = square(1.0);
  for (const Vec2& v : {Vec2{1, 1}, {0, 1}, {0, 0}, {-1, 0.5}, {1, 1}}) EXPECT_TRUE(points.try_push_back(v));
  EXPECT_EQ(convex_hull(points).size(), 4U);
  ConvexPolygon line;
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(line.try_push_back({0.1 * i, 0.2 * i}));
  EXPECT_LT(convex_hull(line).size(), 3U);
  EXPECT_TRUE(convex_hull(ConvexPolygon{}).empty());
}

TEST(BoundingBoxEq16, RandomPoints_TouchesTheExtremes) {
  std::mt19937 random(16);
  const ConvexPolygon hull = convex_hull(random_points(random, 20));
  const BoundingBox box = bounding_box(hull);
  EXPECT_EQ(box.max_m.x(), support_m(hull, Vec2::UnitX()));
  EXPECT_EQ(-box.min_m.y(), support_m(hull, -Vec2::UnitY()));
}

TEST(ContainsEq17, RandomPoints_AgreeWithRowIntervalsAndSignedDistance) {
  std::mt19937 random(17);
  Uniform coordinate(-1.2, 1.2);
  int inside = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const ConvexPolygon hull = convex_hull(random_points(random, 8));
    const Vec2 p{coordinate(random), coordinate(random)};
    const bool in = contains(hull, p);
    inside += in ? 1 : 0;
    EXPECT_EQ(in, signed_distance_m(hull, p) >= 0.0);
    Interval row;
    EXPECT_EQ(in, row_interval(hull, p.y(), row) && row.min_m <= p.x() && p.x() <= row.max_m);
  }
  EXPECT_GT(inside, 4000);
}

TEST(SignedDistance, KnownPointsOfASquare_AreExact) {
  const ConvexPolygon p = square(1.0);
  EXPECT_DOUBLE_EQ(signed_distance_m(p, {0.25, 0}), 0.75);
  EXPECT_DOUBLE_EQ(signed_distance_m(p, {4, 5}), -5.0);  // to the corner: 3, 4, 5
  EXPECT_TRUE(std::isinf(signed_distance_m(ConvexPolygon{}, {0, 0})));
}

TEST(Clip, RandomHalfPlanes_KeepExactlyTheInside) {
  std::mt19937 random(18);
  Uniform coordinate(-1, 1);
  for (int trial = 0; trial < 2000; ++trial) {
    const ConvexPolygon hull = convex_hull(random_points(random, 12));
    const HalfPlane cut{unit_at(Uniform(-kPi, kPi)(random)), Uniform(-0.5, 0.5)(random)};
    const HalfPlane rest{-cut.inward, -cut.offset_m};
    const ConvexPolygon part = clip(hull, cut);
    EXPECT_NEAR(area_m2(part) + area_m2(clip(hull, rest)), area_m2(hull), 1e-12);
    const Vec2 p{coordinate(random), coordinate(random)};
    if (std::abs(cut.distance_m(p)) > 1e-9) {
      EXPECT_EQ(contains(part, p), contains(hull, p) && cut.distance_m(p) > 0);
    }
  }
}

TEST(Clip, WithTags_EdgesKeepTheirsAndTheCutGetsItsOwn) {
  EdgeTags tags{0, 1, 2, 3};
  const ConvexPolygon part = clip(square(1.0), {-Vec2::UnitX(), -0.5}, &tags, 9);  // x <= 0.5
  ASSERT_EQ(part.size(), 4U);
  for (std::size_t i = 0; i < part.size(); ++i) {
    const Vec2 middle = 0.5 * (part[i] + part[(i + 1) % part.size()]);
    const int expected = middle.x() > 0.49 ? 9 : (middle.x() < -0.99 ? 3 : (middle.y() < 0 ? 0 : 2));
    EXPECT_EQ(tags[i], expected);
  }
}

TEST(Intersection, TwoSquares_HaveTheirCommonArea) {
  ConvexPolygon other;
  for (const Vec2& v : square(1.0)) EXPECT_TRUE(other.try_push_back(v + Vec2{0.5, 1.5}));
  EXPECT_NEAR(area_m2(intersection(square(1.0), other)), 1.5 * 0.5, 1e-12);
  EXPECT_NEAR((centroid_m(intersection(square(1.0), other)) - Vec2{0.25, 0.75}).norm(), 0.0, 1e-12);
  for (Vec2& v : other) v.y() += 1.0;
  EXPECT_TRUE(intersection(square(1.0), other).empty());
}

TEST(RotatedRectangleEq34, Overlap_AgainstClippedArea_Agrees) {
  std::mt19937 random(34);
  int both = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const OrientedRectangle a = random_rectangle(random), b = random_rectangle(random);
    const ConvexPolygon pa = corners(a), pb = corners(b);
    ASSERT_GT(area_m2(pa), 0.0);
    const bool shared = area_m2(intersection(pa, pb)) > 1e-9;
    if (shared) {
      EXPECT_TRUE(overlap(a, b));
    }
    if (!shared && overlap(a, b)) {  // only a touch can differ
      OrientedRectangle smaller = a;
      smaller.half_length_m -= 1e-4;
      smaller.half_width_m -= 1e-4;
      EXPECT_FALSE(overlap(smaller, b));
    }
    both += shared ? 1 : 0;
  }
  EXPECT_GT(both, 3000);
}

TEST(Line, HalfPlaneOfALine_IsItsLeftSide) {
  const HalfPlane left = left_side(*line_through({0, 1}, {4, 1}));
  EXPECT_DOUBLE_EQ(left.distance_m({7, 3}), 2.0);
  EXPECT_DOUBLE_EQ(left.distance_m({-7, 0}), -1.0);
  EXPECT_FALSE(line_through({1, 1}, {1, 1}).has_value());
}

TEST(PlaneGeometry, MovedPlane_KeepsItsPoints) {
  const Transform world_T_camera{rotation_y(0.4) * rotation_z(1.0), Vec3{1, 2, 3}};
  const Plane plane{Vec3{0.1, -0.2, -1}.normalized(), 0.9};
  const Vec3 p = plane.project({0.5, -0.3, 2});
  EXPECT_NEAR(plane.distance_m(p), 0.0, 1e-12);
  EXPECT_NEAR((world_T_camera * plane).distance_m(world_T_camera * p), 0.0, 1e-12);
  EXPECT_NEAR(plane.height_m(p.head<2>()), p.z(), 1e-12);
}

}  // namespace
}  // namespace polygmap
