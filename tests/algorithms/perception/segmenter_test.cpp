// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/segmenter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

namespace polygmap {
namespace {

// A wall 1 m ahead in the upper half of the picture, nothing measured in the lower one.
class SegmenterTest : public testing::Test {
 protected:
  SegmenterTest() {
    raw_.intrinsics = {640, 480, 400.0, 400.0, 320.0, 240.0, 0.001};
    raw_.range.set({}, raw_.intrinsics.depth_unit_m);
    raw_.depth = depth_.data();
    std::fill_n(depth_.begin(), depth_.size() / 2, std::uint16_t{1000});
  }
  // In steps of so many units; returns how many steps.
  int run(Segmenter& segmenter, std::int32_t units) {
    segmenter.begin({}, {}, raw_, body_, {});
    for (int steps = 1;; ++steps) {
      WorkBudget budget(units);
      if (segmenter.step(budget) == Progress::kDone) return steps;
    }
  }

  std::vector<std::uint16_t> depth_ = std::vector<std::uint16_t>(std::size_t{640} * 480, 0);
  RawImage raw_;
  std::array<LegShapes, kFootCount> body_{};
  std::unique_ptr<Segmenter> segmenter_ = std::make_unique<Segmenter>();
};

TEST_F(SegmenterTest, EveryColumn_HasOneSegmentAsFarAsTheWallReaches) {
  run(*segmenter_, 1 << 20);
  EXPECT_FALSE(segmenter_->blank());
  EXPECT_NEAR(segmenter_->invalid_fraction(), 0.5, 1e-12);
  EXPECT_EQ(segmenter_->overflow(), 0U);
  for (std::size_t g = 0; g < 80; ++g) {
    const ScanlineSegmentation::Column& segments = segmenter_->segments()[g];
    ASSERT_EQ(segments.size(), 1U) << g;
    EXPECT_EQ(segments[0].top, 0);
    EXPECT_EQ(segments[0].bottom, 239);
    EXPECT_NEAR(segments[0].inverse_depth, 1.0F, 1e-3F);
  }
}

TEST_F(SegmenterTest, AnySlicing_GivesTheSameSegments) {
  const auto sliced = std::make_unique<Segmenter>();
  EXPECT_EQ(run(*segmenter_, 1 << 20), 1);
  EXPECT_EQ(run(*sliced, 1), 6 + 480 / 4) << "shapes of the body, then four rows at a time";
  for (std::size_t g = 0; g < 80; ++g) {
    ASSERT_EQ(sliced->segments()[g].size(), segmenter_->segments()[g].size());
    EXPECT_EQ(sliced->segments()[g][0].bottom, segmenter_->segments()[g][0].bottom);
    EXPECT_EQ(sliced->segments()[g][0].slope, segmenter_->segments()[g][0].slope);
  }
}

TEST_F(SegmenterTest, NothingMeasured_IsBlankAndWhollyInvalid) {
  depth_.assign(depth_.size(), 0);
  run(*segmenter_, 1 << 20);
  EXPECT_TRUE(segmenter_->blank());
  EXPECT_EQ(segmenter_->invalid_fraction(), 1.0);
  depth_.assign(depth_.size(), 1000);
  run(*segmenter_, 1 << 20);
  EXPECT_FALSE(segmenter_->blank()) << "of a frame, not of the one before";
  EXPECT_EQ(segmenter_->invalid_fraction(), 0.0);
}

}  // namespace
}  // namespace polygmap
