// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/span_boundaries.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "tests/support/column_scene.hpp"

namespace polygmap {
namespace {

using test::ColumnScene;

class SpanBoundariesTest : public testing::Test {
 protected:
  static constexpr std::uint8_t kTread = 1, kRiser = 2;

  // The row where the tread, above, meets the riser in a column's ray.
  [[nodiscard]] double meeting_row(std::int32_t column) const {
    const double x = static_cast<double>(scene_.rays.x[static_cast<std::size_t>(column)]);
    const Vec3 d = tread_.m - riser_.m;
    return -(d.x() * x + d.z()) / d.y() * scene_.intrinsics.fy_px + scene_.intrinsics.cy_px;
  }
  // The tread reaches overhang_px beyond where it meets the riser.
  void paint(double overhang_px, double sigma_m, std::uint32_t seed) {
    scene_.paint(
        [=, this](std::int32_t g, std::int32_t r) { return r <= meeting_row(g) + overhang_px ? &tread_ : &riser_; },
        sigma_m, seed);
    boundaries_->begin({}, {}, scene_.rays, scene_.intrinsics.fy_px, scene_.intrinsics.cy_px, *scene_.image);
    boundaries_->set_plane(kTread, tread_);
    boundaries_->set_plane(kRiser, riser_);
    to_plane_[kTread] = kTread;
    to_plane_[kRiser] = kRiser;
  }
  // Segments that end short of the boundary, as segments do.
  void gather(std::int32_t column) {
    ScanlineSegmentation::Column segments;
    const auto row = static_cast<std::int16_t>(meeting_row(column));
    polygmap::ScanlineSegment upper, lower;
    upper.top = static_cast<std::int16_t>(row - 60);
    upper.bottom = static_cast<std::int16_t>(row - 4);
    upper.plane = kTread;
    lower.top = static_cast<std::int16_t>(row + 8);
    lower.bottom = static_cast<std::int16_t>(row + 60);
    lower.plane = kRiser;
    ASSERT_TRUE(segments.try_push_back(upper) && segments.try_push_back(lower));
    boundaries_->build_spans(column, segments, to_plane_);
  }
  void meet() {
    boundaries_->begin_scores();
    for (std::int32_t g = 0; g < kColumns; ++g) {
      gather(g);
      boundaries_->score(g, false);
    }
    boundaries_->begin_placing();
    while (!boundaries_->place_some()) {
    }
  }
  // Columns whose tread ends more than a row from where it should.
  [[nodiscard]] int wrong(double overhang_px) const {
    int wrong = 0;
    for (std::int32_t g = 0; g < kColumns; ++g) {
      const int last = boundaries_->columns()[static_cast<std::size_t>(g)][0].bottom;
      wrong += std::abs(last - (meeting_row(g) + overhang_px - 0.5)) > 1.0 ? 1 : 0;
    }
    return wrong;
  }

  ColumnScene scene_;
  std::unique_ptr<SpanBoundaries> boundaries_ = std::make_unique<SpanBoundaries>();
  std::array<std::uint8_t, SpanBoundaries::kMaxPlanes + 1> to_plane_{};
  InversePlane tread_ = test::plane_of({0.0, -0.86, -0.5}, 0.6);
  InversePlane riser_ = test::plane_of({-0.15, 0.48, -0.86}, 0.7);
};

TEST_F(SpanBoundariesTest, PlanesThatMeet_EndWhereTheyMeet) {
  paint(0.0, 0.003, 1);
  meet();
  EXPECT_EQ(wrong(0.0), 0);
}

TEST_F(SpanBoundariesTest, AnOverhang_EndsWhereThePixelsSay) {
  paint(5.0, 0.003, 2);
  meet();
  EXPECT_EQ(wrong(5.0), 0);
}

TEST_F(SpanBoundariesTest, PlanesThatChange_TakeTheirBoundaryAlong) {
  paint(0.0, 0.003, 3);
  meet();
  tread_ = test::plane_of({0.01, -0.86, -0.5}, 0.605);
  EXPECT_GT(wrong(0.0), kColumns / 2);
  boundaries_->set_plane(kTread, tread_);
  boundaries_->begin_reprojecting();
  while (!boundaries_->reproject_some()) {
  }
  EXPECT_EQ(wrong(0.0), 0);
}

TEST_F(SpanBoundariesTest, AColumnWithoutASegment_TakesTheRowsThatTheOneBesideShows) {
  paint(0.0, 0.003, 4);
  gather(10);
  boundaries_->build_spans(11, {}, to_plane_);
  boundaries_->fill_gaps(11, 10, 1, 0);
  const SpanBoundaries::Column& claimed = boundaries_->columns()[11];
  ASSERT_EQ(claimed.size(), 2U);
  EXPECT_EQ(claimed[0].plane, kTread);
  EXPECT_EQ(claimed[1].plane, kRiser);
  EXPECT_LT(claimed[0].bottom, claimed[1].top);
  EXPECT_NEAR(claimed[0].bottom, meeting_row(11), 4.0);
}

TEST_F(SpanBoundariesTest, RowsOfSomethingElse_AreNotClaimed) {
  paint(0.0, 0.003, 5);
  const InversePlane far = test::plane_of({0.0, 0.0, -1.0}, 3.0);
  gather(10);
  for (std::int32_t r = 0; r < kDepthHeight_px; ++r) {
    scene_.image->inverse_depth(11, r) = static_cast<float>(far.inverse_depth(scene_.ray(11, r)));
  }
  scene_.image->transpose(0, kDepthHeight_px - 1);
  boundaries_->build_spans(11, {}, to_plane_);
  boundaries_->fill_gaps(11, 10, 1, 0);
  EXPECT_TRUE(boundaries_->columns()[11].empty());
}

// Rows of a column that lie on the tread; all others lie far behind it.
class SpanBoundariesClaimTest : public SpanBoundariesTest {
 protected:
  static constexpr std::int32_t kFirst = 101, kLast = 300;  // that the column beside shows
  void show(const std::function<bool(std::int32_t)>& on_tread) {
    const InversePlane far = test::plane_of({0.0, 0.0, -1.0}, 3.0);
    scene_.paint([&](std::int32_t g, std::int32_t r) { return g == 10 || on_tread(r) ? &wall_ : &far; }, 0.0, 1);
    boundaries_->begin({}, {}, scene_.rays, scene_.intrinsics.fy_px, scene_.intrinsics.cy_px, *scene_.image);
    boundaries_->set_plane(kTread, wall_);
    to_plane_[kTread] = kTread;
    ScanlineSegmentation::Column segments;
    polygmap::ScanlineSegment segment;
    segment.top = kFirst + 4;
    segment.bottom = kLast - 4;
    segment.plane = kTread;
    ASSERT_TRUE(segments.try_push_back(segment));
    boundaries_->build_spans(10, segments, to_plane_);
    boundaries_->build_spans(11, {}, to_plane_);
    boundaries_->fill_gaps(11, 10, 1, 0);
  }
  void expect_claimed(std::int32_t top, std::int32_t bottom) const {
    const SpanBoundaries::Column& claimed = boundaries_->columns()[11];
    ASSERT_EQ(claimed.size(), 1U);
    EXPECT_EQ(claimed[0].top, top);
    EXPECT_EQ(claimed[0].bottom, bottom);
  }
  InversePlane wall_ = test::plane_of({0.0, 0.0, -1.0}, 1.0);
};

TEST_F(SpanBoundariesClaimTest, AllOfThem_AreOneStretch) {
  show([](std::int32_t) { return true; });
  expect_claimed(kFirst, kLast);
}

TEST_F(SpanBoundariesClaimTest, SingleRowsOffThePlane_DoNotEndAStretch) {
  show([](std::int32_t r) { return r >= 110 && r <= 250 && r % 2 == 1; });
  expect_claimed(111, 249);
}

TEST_F(SpanBoundariesClaimTest, TwoRowsOffThePlane_EndAStretch) {
  for (const std::int32_t gap : {160, 161, 162, 163, 164, 165, 166, 167}) {  // where words of 64 bits meet, too
    show([gap](std::int32_t r) { return r != gap && r != gap + 1; });
    expect_claimed(gap + 2, kLast);
  }
}

TEST_F(SpanBoundariesClaimTest, ASingleRow_IsNotClaimed) {
  show([](std::int32_t r) { return r % 3 == 0; });
  EXPECT_TRUE(boundaries_->columns()[11].empty());
}

TEST_F(SpanBoundariesTest, ASegmentThatReachesOverTheEdge_IsTrimmed) {
  paint(0.0, 0.0, 6);
  const auto row = static_cast<std::int16_t>(meeting_row(40));
  ScanlineSegmentation::Column segments;
  polygmap::ScanlineSegment segment;
  segment.top = static_cast<std::int16_t>(row - 60);
  segment.bottom = static_cast<std::int16_t>(row + 5);
  segment.plane = kTread;
  ASSERT_TRUE(segments.try_push_back(segment));
  boundaries_->build_spans(40, segments, to_plane_);
  EXPECT_EQ(boundaries_->columns()[40][0].bottom, row + 5);
  boundaries_->trim_ends(40);
  EXPECT_LT(boundaries_->columns()[40][0].bottom, row + 5);
  EXPECT_GE(boundaries_->columns()[40][0].bottom, row - 1);
  EXPECT_EQ(boundaries_->columns()[40][0].top, row - 60);
}

}  // namespace
}  // namespace polygmap
