// SPDX-License-Identifier: Apache-2.0
// Growing planes from segments, and the boundaries between them.
#include "algorithms/perception/planes/plane_growing.hpp"

#include <gtest/gtest.h>

#include "algorithms/perception/planes/span_boundaries.hpp"
#include "tests/support/column_scene.hpp"

namespace polygmap {
namespace {

using test::ColumnScene;

class PlaneGrowingTest : public testing::Test {
 protected:
  void grow(const PlaneGrowing::Params& params = {}) {
    segments_->begin({}, {}, scene_.intrinsics, *scene_.image);
    for (std::int32_t r = 0; r < kDepthHeight_px; r += ScanlineSegmentation::kBlock)
      segments_->add_rows(r, r + ScanlineSegmentation::kBlock - 1);
    segments_->finish();
    growing_->begin(params, {}, scene_.rays, segments_->columns());
    while (!growing_->step()) {
    }
  }
  // One pass of boundaries with the grown planes as they are; then a refit.
  void bound(const SpanBoundaries::Params& params = {}) {
    boundaries_->begin(params, {}, scene_.rays, scene_.intrinsics.fy_px, scene_.intrinsics.cy_px, *scene_.image);
    std::array<std::uint8_t, SpanBoundaries::kMaxPlanes + 1> to_plane{};
    for (std::size_t i = 1; i <= growing_->count(); ++i) {
      boundaries_->set_plane(i, growing_->plane(i).plane);
      to_plane[i] = static_cast<std::uint8_t>(i);
    }
    boundaries_->begin_scores();
    for (std::int32_t g = 0; g < kColumns; ++g) {
      boundaries_->build_spans(g, segments_->columns()[static_cast<std::size_t>(g)], to_plane);
      boundaries_->score(g, false);
    }
    boundaries_->begin_placing();
    while (!boundaries_->place_some()) {
    }
    boundaries_->begin_refit();
    for (std::int32_t g = 0; g < kColumns; g += SpanBoundaries::kRefitColumns) {
      while (!boundaries_->refit_some(g, false)) {
      }
    }
  }
  // Row at which plane a, above, hands over to b in a column's ray.
  [[nodiscard]] double meeting_row(const InversePlane& a, const InversePlane& b, std::int32_t column) const {
    const double x = static_cast<double>(scene_.rays.x[static_cast<std::size_t>(column)]);
    const Vec3 d = a.m - b.m;
    return -(d.x() * x + d.z()) / d.y() * scene_.intrinsics.fy_px + scene_.intrinsics.cy_px;
  }
  // A tread above, the riser in front of it below: they meet on a slanted line in the picture.
  void paint_step(double sigma_m, std::uint32_t seed) {
    scene_.paint(
        [this](std::int32_t g, std::int32_t r) { return r <= meeting_row(tread_, riser_, g) ? &tread_ : &riser_; },
        sigma_m, seed);
  }
  ColumnScene scene_;
  std::unique_ptr<ScanlineSegmentation> segments_ = std::make_unique<ScanlineSegmentation>();
  std::unique_ptr<PlaneGrowing> growing_ = std::make_unique<PlaneGrowing>();
  std::unique_ptr<SpanBoundaries> boundaries_ = std::make_unique<SpanBoundaries>();
  InversePlane tread_ = test::plane_of({0.0, -0.86, -0.5}, 0.6);
  InversePlane riser_ = test::plane_of({-0.15, 0.48, -0.86}, 0.7);
};

TEST_F(PlaneGrowingTest, TreadAndRiser_AreTwoPlanesWithTheirNormals) {
  paint_step(0.0015, 2);
  grow();
  ASSERT_EQ(growing_->count(), 2U);
  for (const InversePlane& truth : {tread_, riser_}) {
    double best = 0.0;
    for (std::size_t i = 1; i <= 2; ++i) {
      best = std::max(best, growing_->plane(i).plane.normal().dot(truth.normal()));
    }
    EXPECT_GT(best, std::cos(0.01));
  }
}

TEST_F(PlaneGrowingTest, PatchSmallerThanTheLeast_IsNoPlane) {
  const auto patch = [this](std::int32_t g, std::int32_t r) {
    return g >= 60 && g < 63 && r >= 100 && r < 120 ? &tread_ : nullptr;
  };
  scene_.paint(patch);
  grow({.min_facet_px = 600});
  EXPECT_EQ(growing_->count(), 0U);
  grow({.min_facet_px = 300});
  EXPECT_EQ(growing_->count(), 1U);
}

TEST_F(PlaneGrowingTest, MeetingPlanes_AreCutWhereTheyMeet) {
  paint_step(0.002, 4);
  grow();
  bound();
  int seen = 0;
  for (std::int32_t g = 0; g < kColumns; ++g) {
    const SpanBoundaries::Column& spans = boundaries_->columns()[static_cast<std::size_t>(g)];
    if (spans.size() != 2) continue;
    ++seen;
    EXPECT_NEAR(spans[0].bottom + 0.5, meeting_row(tread_, riser_, g), 1.1) << g;
    EXPECT_EQ(spans[1].top, spans[0].bottom + 1);
  }
  EXPECT_GT(seen, kColumns * 9 / 10);
}

TEST_F(PlaneGrowingTest, OverhangingPlane_IsCutWhereThePictureChanges) {
  // The tread reaches 12 rows farther down than where the planes meet, as a nosing does.
  constexpr double kOver_px = 12.0;
  scene_.paint([this](std::int32_t g,
                      std::int32_t r) { return r <= meeting_row(tread_, riser_, g) + kOver_px ? &tread_ : &riser_; },
               0.001, 6);
  grow();
  bound({.window_px = 20});
  int seen = 0;
  for (std::int32_t g = 0; g < kColumns; ++g) {
    const SpanBoundaries::Column& spans = boundaries_->columns()[static_cast<std::size_t>(g)];
    if (spans.size() != 2) continue;
    ++seen;
    EXPECT_NEAR(spans[0].bottom + 0.5, meeting_row(tread_, riser_, g) + kOver_px, 1.6) << g;
  }
  EXPECT_GT(seen, kColumns * 9 / 10);
}

TEST_F(PlaneGrowingTest, Refit_RecoversThePlanesThroughNoise) {
  paint_step(0.002, 8);
  grow();
  bound();
  for (std::size_t i = 1; i <= 2; ++i) {
    InversePlane plane;
    ASSERT_TRUE(try_solve({}, {}, boundaries_->plane(i).moments, Lean::kAny, Vec3::UnitY(), plane, nullptr));
    const InversePlane& truth =
        plane.normal().dot(tread_.normal()) > plane.normal().dot(riser_.normal()) ? tread_ : riser_;
    EXPECT_LT(std::acos(std::min(plane.normal().dot(truth.normal()), 1.0)), 5e-4);
    EXPECT_NEAR(plane.d_m(), truth.d_m(), 3e-4);
  }
}

}  // namespace
}  // namespace polygmap
