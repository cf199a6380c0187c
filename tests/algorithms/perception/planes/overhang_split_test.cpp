// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/planes/overhang_split.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "tests/support/column_scene.hpp"

namespace polygmap {
namespace {

constexpr PlaneId kLeaning = 1;
constexpr std::int32_t kFirstColumn = 20, kLastColumn = 59;
constexpr std::int16_t kTop = 231, kBottom = 250;    // some eight rows of each surface
constexpr double kDown_rad = 1.05, kMiddle_m = 0.8;  // the camera looks down by as much; depth along its axis

// One grown plane that leans, in a picture whose rows show something upright at some distance along the level.
class OverhangSplitTest : public testing::Test {
 protected:
  OverhangSplitTest() {
    picture_->column_rays = scene_.rays;
    planes_->count = 1;
    to_plane_[kLeaning] = kLeaning;
    FittedPlane& leaning = (*planes_)[kLeaning];
    const Vec3 normal = std::cos(0.3) * -ahead_ - std::sin(0.3) * up_;
    leaning.plane = test::plane_of(normal, -normal.z() * kMiddle_m);
    leaning.centre_m = {0.0, 0.0, kMiddle_m};
    leaning.alive = true;
  }
  // farther_m of a row and column.
  void paint(const std::function<double(std::int32_t, std::int32_t)>& farther_m) {
    for (std::int32_t g = kFirstColumn; g <= kLastColumn; ++g) {
      for (std::int32_t r = kTop; r <= kBottom; ++r) {
        const double distance_m = kMiddle_m * ahead_.z() + farther_m(g, r);
        picture_->columns.by_column(r, g) = static_cast<float>(ahead_.dot(scene_.ray(g, r)) / distance_m);
      }
    }
  }
  void paint_leaning() {
    const InversePlane& plane = (*planes_)[kLeaning].plane;
    paint([&](std::int32_t g, std::int32_t r) {
      return ahead_.dot(plane.point(scene_.ray(g, r))) - kMiddle_m * ahead_.z();
    });
  }
  [[nodiscard]] bool try_split(OverhangSplit::Halves& halves) {
    split_->begin({}, up_, *planes_);
    EXPECT_TRUE(split_->any());
    for (std::int32_t g = kFirstColumn; g <= kLastColumn; ++g) {
      SpanBoundaries::Column spans;
      ColumnSpan span;
      span.top = kTop, span.bottom = kBottom, span.plane = kLeaning;
      EXPECT_TRUE(spans.try_push_back(span));
      split_->add_column(*picture_, g, spans, to_plane_);
    }
    return split_->try_split(kLeaning, halves);
  }

  const Vec3 up_{0.0, -std::cos(kDown_rad), -std::sin(kDown_rad)},
      ahead_{0.0, -std::sin(kDown_rad), std::cos(kDown_rad)};
  const test::ColumnScene scene_;
  std::unique_ptr<FrameImage> picture_ = std::make_unique<FrameImage>();
  std::unique_ptr<PlaneSet> planes_ = std::make_unique<PlaneSet>();
  std::unique_ptr<OverhangSplit> split_ = std::make_unique<OverhangSplit>();
  PlaneMerging::PlaneIndex to_plane_{};
};

// A face 30 mm before the riser. Where it ends, mixed_rows of every column show what is neither: a point between the
// two on the line of sight.
TEST_F(OverhangSplitTest, FaceAndRiserWithRowsMixedOfBoth_AreSplit) {
  constexpr double kFace_m = -0.015, kRiser_m = 0.015;
  constexpr std::int32_t kEnd = 239;
  for (const int mixed_rows : {0, 1, 2, 3}) {
    SCOPED_TRACE(mixed_rows);
    paint([&](std::int32_t, std::int32_t r) {
      if (r <= kEnd) return kFace_m;
      if (r > kEnd + mixed_rows) return kRiser_m;
      return kFace_m + (kRiser_m - kFace_m) * (r - kEnd) / (mixed_rows + 1);
    });
    OverhangSplit::Halves halves;
    ASSERT_TRUE(try_split(halves));
    const double first_m = halves.larger.d_m(), second_m = halves.smaller.d_m(), middle_m = kMiddle_m * ahead_.z();
    EXPECT_NEAR(std::min(first_m, second_m), middle_m + kFace_m, 0.002);
    EXPECT_NEAR(std::max(first_m, second_m), middle_m + kRiser_m, 0.002);
  }
}

TEST_F(OverhangSplitTest, EvenSlope_IsOnePlane) {
  paint_leaning();
  OverhangSplit::Halves halves;
  EXPECT_FALSE(try_split(halves));
}

// Heights that no row shows are no proof of a step: what is left of the slope rises as evenly on both sides of them.
TEST_F(OverhangSplitTest, EvenSlopeWithoutItsMiddle_IsOnePlane) {
  paint_leaning();
  for (std::int32_t g = kFirstColumn; g <= kLastColumn; ++g) {
    for (std::int32_t r = 238; r < 243; ++r) picture_->columns.by_column(r, g) = 0.0F;
  }
  OverhangSplit::Halves halves;
  EXPECT_FALSE(try_split(halves));
}

}  // namespace
}  // namespace polygmap
