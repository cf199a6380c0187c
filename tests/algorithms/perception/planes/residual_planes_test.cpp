// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/residual_planes.hpp"

#include <gtest/gtest.h>

#include "tests/support/column_scene.hpp"

namespace polygmap {
namespace {

using test::ColumnScene;

class ResidualPlaneSearchTest : public testing::Test {
 protected:
  // Looks for planes in what the spans of every column leave over.
  void search(const SpanBoundaries::Column& spans = {}) {
    for (std::int32_t g = 0; g < kColumns; ++g) search_->add_column(scene_.rays, *scene_.image, g, spans);
    search_->finish();
  }
  [[nodiscard]] static SpanBoundaries::Column spans_from(std::int16_t top) {
    SpanBoundaries::Column spans;
    EXPECT_TRUE(spans.try_push_back({top, kDepthHeight_px - 1, 1, 0}));
    return spans;
  }
  ColumnScene scene_;
  Vec3 up_ = Vec3{0.0, -0.86, -0.51}.normalized();
  Vec3 towards_ = Vec3{-0.1, 0.5, -0.85};
  InversePlane tread_ = test::plane_of(up_, 0.6);
  InversePlane riser_ = test::plane_of(Vec3{towards_ - up_ * up_.dot(towards_)}, 1.1);
  std::unique_ptr<ResidualPlaneSearch> search_ = std::make_unique<ResidualPlaneSearch>();
};

TEST_F(ResidualPlaneSearchTest, AFewLevelRows_AreFoundAtTheirHeight) {
  // Three noisy rows 3 m away: no run of them says how they lie.
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    scene_.paint([this](std::int32_t, std::int32_t r) { return r >= 100 && r < 103 ? &tread_ : nullptr; }, 0.004, seed);
    search_->begin({}, up_);
    search(spans_from(120));
    ASSERT_EQ(search_->found().size(), 1U);
    EXPECT_NEAR(search_->found()[0].d_m(), 0.6, 0.002);
    EXPECT_GT(search_->found()[0].normal().dot(up_), 0.9999);
  }
}

TEST_F(ResidualPlaneSearchTest, RowsDeepInClutter_AreNotLookedAt) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r >= 100 && r < 103 ? &tread_ : nullptr; });
  for (const std::int16_t end : {std::int16_t{103 + kRemainderReach_px}, std::int16_t{99 + kRemainderReach_px}}) {
    search_->begin({}, up_);
    search(spans_from(end));
    EXPECT_EQ(search_->found().size(), end < 100 + kRemainderReach_px ? 1U : 0U);
  }
}

TEST_F(ResidualPlaneSearchTest, RowsOfAPlaneGivenUp_AreSearchedAgain) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r >= 10 && r < 13 ? &tread_ : nullptr; });
  for (const bool given_back : {false, true}) {
    search_->begin({}, up_);
    if (given_back) search_->release(1);
    search(spans_from(5));
    EXPECT_EQ(search_->found().size(), given_back ? 1U : 0U);
  }
}

TEST_F(ResidualPlaneSearchTest, UprightRows_AreFoundParallelToTheKnownRiser) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r < 4 ? &riser_ : nullptr; }, 0.003);
  search_->begin({}, up_);
  search();
  EXPECT_EQ(search_->found().size(), 0U);  // which way risers face is not known
  search_->begin({}, up_);
  search_->add_known_riser(test::plane_of(riser_.normal(), 0.8), 5000.0);
  search();
  ASSERT_EQ(search_->found().size(), 1U);
  EXPECT_NEAR(search_->found()[0].d_m(), 1.1, 0.003);
}

TEST_F(ResidualPlaneSearchTest, AKnownPlane_IsNotFoundAgain) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r < 20 ? &tread_ : nullptr; }, 0.002);
  search_->begin({}, up_);
  search_->add_known_level(test::plane_of(up_, 0.606));
  search();
  EXPECT_EQ(search_->found().size(), 0U);
}

TEST_F(ResidualPlaneSearchTest, RowsInSpans_AreNotLookedAt) {
  scene_.paint([this](std::int32_t, std::int32_t r) { return r < 20 ? &tread_ : nullptr; }, 0.002);
  SpanBoundaries::Column spans;
  ColumnSpan span;
  span.top = 0;
  span.bottom = 19;
  span.plane = 1;
  ASSERT_TRUE(spans.try_push_back(span));
  search_->begin({}, up_);
  search(spans);
  EXPECT_EQ(search_->found().size(), 0U);
}

TEST_F(ResidualPlaneSearchTest, ASlope_HasNoPeakOfHeights) {
  const InversePlane slope = test::plane_of(up_ + Vec3{0.0, 0.3, -0.3}, 0.7);
  scene_.paint([&](std::int32_t, std::int32_t r) { return r > 100 && r < 400 ? &slope : nullptr; }, 0.002);
  search_->begin({}, up_);
  search();
  EXPECT_EQ(search_->found().size(), 0U);
}

}  // namespace
}  // namespace polygmap
