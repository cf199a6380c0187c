// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/plane_merging.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

namespace polygmap {
namespace {

constexpr DepthNoiseModel kNoise{.base_m = 0.001, .per_metre = 0.0015};

// Planes, one below the other in the picture, and the spans in which they were seen.
class SeenPlanes {
 public:
  explicit SeenPlanes(std::size_t count = 2) {
    rays_.set({640, 480, 460.0, 460.0, 319.5, 239.5, 0.001});
    planes_->count = static_cast<PlaneId>(count);
    for (std::size_t i = 0; i < to_plane_.size(); ++i) to_plane_[i] = static_cast<std::uint8_t>(i);
  }
  // Columns and rows from .. to - 1 of the picture show n . p + d = 0.
  void show(std::uint8_t index, const Vec3& normal, const Vec3& through_m, std::int32_t first_column,
            std::int32_t last_column, std::int16_t top, std::int16_t bottom) {
    FittedPlane& plane = (*planes_)[index];
    plane = FittedPlane{};
    plane.alive = true;
    plane.plane.m = normal / normal.dot(through_m);
    for (std::int32_t g = first_column; g <= last_column; ++g) {
      ColumnSpan span;
      span.top = top;
      span.bottom = bottom;
      span.plane = index;
      ASSERT_TRUE((*columns_)[static_cast<std::size_t>(g)].try_push_back(span));
      for (std::int32_t r = top; r <= bottom; ++r) {
        const auto x = static_cast<double>(rays_.x[static_cast<std::size_t>(g)]);
        const auto y = static_cast<double>(rays_.y[static_cast<std::size_t>(r)]);
        const double w = plane.plane.inverse_depth({x, y, 1.0});
        const double sigma = kNoise.inverse_sigma(w) / w;  // of w, at normal incidence
        plane.moments.add(kColumn_px / (sigma * sigma), x, y, w);
        plane.moments.count += kColumn_px - 1;
      }
    }
    plane.pixels = plane.moments.count;
    plane.centre_m = plane.plane.point(plane.moments.mean_ray());
  }
  // Planes that are left.
  int join() {
    begin();
    while (!merging_->join_some(*planes_, to_plane_)) ++calls_;
    return static_cast<int>(std::count_if(planes_->planes.begin() + 1, planes_->planes.end(),
                                          [](const FittedPlane& plane) { return plane.alive; }));
  }
  void begin() {
    merging_->begin_facets({}, {}, kNoise, *planes_);
    const auto columns = static_cast<std::size_t>(rays_.columns);
    for (std::size_t g = 0; g < columns; ++g) {
      merging_->add_column((*columns_)[g], g + 1 < columns ? &(*columns_)[g + 1] : nullptr, to_plane_);
    }
  }
  [[nodiscard]] int calls() const { return calls_; }  // of join_some, but for the last
  [[nodiscard]] std::uint32_t overflow() const { return merging_->overflow(); }
  int merge(bool measured) {
    merging_->begin_coplanar({}, {}, kNoise, *planes_, measured);
    while (!merging_->merge_some(*planes_, to_plane_)) {
    }
    return ((*planes_)[1].alive ? 1 : 0) + ((*planes_)[2].alive ? 1 : 0);
  }
  void make_risers() { (*planes_)[1].kind = (*planes_)[2].kind = SurfaceKind::kRiser; }
  void make_facets() { (*planes_)[1].facet = (*planes_)[2].facet = true; }
  [[nodiscard]] const FittedPlane& plane(std::size_t i) const { return (*planes_)[i]; }
  [[nodiscard]] std::uint8_t to_plane(std::size_t i) const { return to_plane_[i]; }

 private:
  ColumnRays rays_;
  std::unique_ptr<PlaneSet> planes_ = std::make_unique<PlaneSet>();
  std::unique_ptr<SpanBoundaries::Columns> columns_ = std::make_unique<SpanBoundaries::Columns>();
  std::unique_ptr<PlaneMerging> merging_ = std::make_unique<PlaneMerging>();
  PlaneMerging::PlaneIndex to_plane_{};
  int calls_ = 0;
};

Vec3 leaning(double rad) { return {0.0, -math::sin(rad), -math::cos(rad)}; }

// A cushion at 2.8 m: 100 mm of it above and below its bend.
TEST(PlaneMerging, FacetsThatBendWithinTheNoise_BecomeOneSurface) {
  SeenPlanes planes;
  planes.show(1, leaning(0.15), {0.0, 0.0, 2.8}, 36, 43, 223, 239);
  planes.show(2, leaning(-0.15), {0.0, 0.0, 2.8}, 36, 43, 240, 256);
  ASSERT_EQ(planes.join(), 1);
  EXPECT_TRUE(planes.plane(1).alive);
  EXPECT_EQ(planes.to_plane(2), 1);
  EXPECT_EQ(planes.plane(1).facets, 2);
  EXPECT_NEAR(planes.plane(1).plane.normal().z(), -1.0, 1e-3);
  EXPECT_NEAR(planes.plane(1).pixels, 8.0 * 8.0 * 34.0, 1.0);
}

TEST(PlaneMerging, FacetsOfAStrongBend_StayTwo) {
  SeenPlanes planes;
  planes.show(1, leaning(0.25), {0.0, 0.0, 2.8}, 24, 55, 180, 239);
  planes.show(2, leaning(-0.25), {0.0, 0.0, 2.8}, 24, 55, 240, 299);
  EXPECT_EQ(planes.join(), 2);
}

TEST(PlaneMerging, FacetsThatDoNotTouch_StayTwo) {
  SeenPlanes planes;
  planes.show(1, leaning(0.15), {0.0, 0.0, 2.8}, 36, 43, 213, 229);
  planes.show(2, leaning(-0.15), {0.0, 0.0, 2.8}, 36, 43, 260, 276);
  EXPECT_EQ(planes.join(), 2);
}

// Two treads 40 mm apart in height, 2.5 m away, of which the riser between was not seen.
TEST(PlaneMerging, StepOfFortyMillimetres_StaysTwo) {
  SeenPlanes planes;
  const Vec3 up = leaning(0.9);
  planes.show(1, up, Vec3{0.0, 0.0, 2.5} + 0.04 * up, 28, 51, 204, 239);
  planes.show(2, up, {0.0, 0.0, 2.5}, 28, 51, 240, 275);
  EXPECT_EQ(planes.join(), 2);
}

// The face of a slab that overhangs by 25 mm, and below it the foot of the riser behind: two strips too thin to
// contradict the ramp through both, which leans against either.
TEST(PlaneMerging, FaceOfAnOverhangAndTheRiserBehind_StayTwo) {
  SeenPlanes planes;
  const Vec3 front = leaning(-0.5), up = leaning(0.5 * kPi - 0.5);
  planes.show(1, front, {0.0, 0.0, 1.2}, 36, 43, 228, 239);
  planes.show(2, front, Vec3{0.0, 0.0, 1.2} - 0.025 * front - 0.03 * up, 36, 43, 240, 251);
  EXPECT_EQ(planes.join(), 2);
}

// Each is too small to be a plane by itself. 8 x 8 columns and rows are 512 pixels.
TEST(PlaneMerging, TwoSmallFacets_AreOnePlaneTogether_AndNoneAlone) {
  SeenPlanes planes;
  planes.show(1, leaning(0.15), {0.0, 0.0, 2.8}, 36, 43, 232, 239);
  planes.show(2, leaning(-0.15), {0.0, 0.0, 2.8}, 36, 43, 240, 247);
  planes.make_facets();
  EXPECT_EQ(planes.merge(true), 2);  // pieces need not touch, facets must
  ASSERT_EQ(planes.join(), 1);
  EXPECT_FALSE(planes.plane(1).facet);
  SeenPlanes apart;
  apart.show(1, leaning(0.15), {0.0, 0.0, 2.8}, 36, 43, 200, 207);
  apart.show(2, leaning(-0.15), {0.0, 0.0, 2.8}, 36, 43, 240, 247);
  apart.make_facets();
  EXPECT_EQ(apart.join(), 2);
  EXPECT_TRUE(apart.plane(1).facet && apart.plane(2).facet);
}

// A floor to the left and the right of something: where the camera bends it by 12 mm the pixels say that one plane does
// not hold both, though a run of one could join the other.
TEST(PlaneMerging, LargePiecesFarApart_AreOneOnlyWherePixelsDoNotContradict) {
  const Vec3 up = leaning(1.0), floor{0.0, 0.0, 2.0};
  for (const double bent_m : {0.001, 0.012}) {
    SeenPlanes planes;
    planes.show(1, up, floor, 0, 29, 200, 399);
    planes.show(2, up, floor + bent_m * up, 60, 79, 200, 399);
    EXPECT_EQ(planes.merge(true), bent_m < 0.01 ? 1 : 2) << bent_m;
  }
}

// The same, 5 mm apart: each side's centre is 5 mm off the other's plane, together a little more than what lets a run
// join. Before planes are measured that is a doubt.
TEST(PlaneMerging, LargePiecesALittleApart_AreOneOnceTheyAreMeasured) {
  const Vec3 up = leaning(1.0), floor{0.0, 0.0, 2.0};
  for (const bool measured : {false, true}) {
    SeenPlanes planes;
    planes.show(1, up, floor, 0, 29, 200, 399);
    planes.show(2, up, floor + 0.005 * up, 60, 79, 200, 399);
    EXPECT_EQ(planes.merge(measured), measured ? 1 : 2);
  }
  SeenPlanes same;
  same.show(1, up, floor, 0, 29, 200, 399);
  same.show(2, up, floor + 0.001 * up, 60, 79, 200, 399);
  EXPECT_EQ(same.merge(false), 1);
}

// Noise has turned both by a degree. Twenty rows high, they cannot touch along more.
TEST(PlaneMerging, PiecesOfALowRiserSideBySide_AreOne_OfAnyOtherSurface_Two) {
  for (const bool riser : {false, true}) {
    SeenPlanes seen;
    seen.show(1, Vec3{0.01, 0.8, -0.6}.normalized(), {0.0, -0.45, 0.85}, 10, 39, 0, 19);
    seen.show(2, Vec3{-0.01, 0.8, -0.6}.normalized(), {0.0, -0.45, 0.85}, 40, 69, 0, 19);
    if (riser) seen.make_risers();
    EXPECT_EQ(seen.join(), riser ? 1 : 2);
    EXPECT_EQ(seen.plane(1).low_parts, riser);
  }
}

// A tread and its riser bend by a right angle: nothing joins them however few their pixels.
TEST(PlaneMerging, TreadAndRiser_StayTwo) {
  SeenPlanes planes;
  planes.show(1, leaning(0.9), {0.0, 0.0, 3.0}, 30, 49, 232, 239);
  planes.show(2, leaning(0.9 - 0.5 * kPi), {0.0, 0.0, 3.0}, 30, 49, 240, 247);
  EXPECT_EQ(planes.join(), 2);
}

// A column of radius 1 m at 3 m, seen in thirty strips: eight seams at most are looked at in one call, and a join is
// one.
TEST(PlaneMerging, ManyFacets_AreJoinedABoundedPieceAtATime) {
  constexpr int kStrips = 30;
  SeenPlanes planes(kStrips);
  for (int i = 0; i < kStrips; ++i) {
    const double lean = 0.02 * (i - 0.5 * kStrips);
    planes.show(static_cast<std::uint8_t>(i + 1), leaning(lean), {0.0, -math::sin(lean), 3.0 - math::cos(lean)}, 20, 59,
                static_cast<std::int16_t>(90 + 10 * i), static_cast<std::int16_t>(99 + 10 * i));
  }
  const int left = planes.join();
  EXPECT_LE(left, 2 * kStrips / 3);
  EXPECT_GE(planes.calls(), (kStrips - 1) / 8 + (kStrips - left));
  EXPECT_EQ(planes.overflow(), 0U);
}

// More seams than there is room for are counted and left apart.
TEST(PlaneMerging, MoreSeamsThanThereIsRoomFor_AreCounted) {
  constexpr int kPlanes = 64;
  SeenPlanes planes(kPlanes);
  const auto show = [&](int i, int column, int top) {
    planes.show(static_cast<std::uint8_t>(i + 1), leaning(0.0), {0.0, 0.0, 1.0 + 0.05 * i}, column, column,
                static_cast<std::int16_t>(top), static_cast<std::int16_t>(top + 9));
  };
  for (int column = 0; column < 80; ++column) {
    for (int k = 0; k < 24; ++k) show((k * (column % 31 + 1) + column) % kPlanes, column, 20 * k);
  }
  EXPECT_EQ(planes.join(), kPlanes);
  EXPECT_GT(planes.overflow(), 0U);
}

}  // namespace
}  // namespace polygmap
