// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/pixel_labels.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace polygmap {
namespace {

constexpr std::int32_t kWidth_px = 640, kHeight_px = 480;

// Two planes in a picture, and columns of eight pixels that each end them at one row.
class PixelLabelsTest : public testing::Test {
 protected:
  PixelLabelsTest() {
    raw_.intrinsics = {kWidth_px, kHeight_px, 400.0, 400.0, 320.0, 240.0, 0.001};
    raw_.range.set({}, raw_.intrinsics.depth_unit_m);
    raw_.depth = depth_.data();
    picture_->rays.set(raw_.intrinsics);
    picture_->column_rays.set(raw_.intrinsics);
    picture_->flags.fill(0);
    regions_->labels.by_column.fill(kNoRegion);
    regions_->count = 2;
  }
  void set_plane(std::size_t index, const Vec3& normal, const Vec3& through_m) {
    (*regions_)[index].plane.m = normal / normal.dot(through_m);
  }
  [[nodiscard]] double inverse_depth(std::size_t plane, double column, double row) const {
    return (*regions_)[plane].plane.inverse_depth({(column - 320.0) / 400.0, (row - 240.0) / 400.0, 1.0});
  }
  void see(std::size_t plane, std::int32_t column, std::int32_t row) {
    depth_[static_cast<std::size_t>(row * kWidth_px + column)] =
        static_cast<std::uint16_t>(1000.0 / inverse_depth(plane, column, row) + 0.5);
  }
  void own(std::size_t plane, std::int32_t g, std::int32_t first_row, std::int32_t last_row) {
    for (std::int32_t r = first_row; r <= last_row; ++r) {
      regions_->labels.at(g, r) = static_cast<RegionId>(plane);
    }
  }
  [[nodiscard]] std::size_t label(std::int32_t column, std::int32_t row) const {
    return pixel_label(*picture_, raw_, {}, *regions_, *published_, column, row);
  }

  std::vector<std::uint16_t> depth_ = std::vector<std::uint16_t>(static_cast<std::size_t>(kWidth_px) * kHeight_px);
  RawImage raw_;
  std::unique_ptr<FrameImage> picture_ = std::make_unique<FrameImage>();
  std::unique_ptr<Regions> regions_ = std::make_unique<Regions>();
  std::unique_ptr<PublishedSurfaces> published_ = std::make_unique<PublishedSurfaces>();
};

TEST_F(PixelLabelsTest, PlanesThatMeetAskew_EndWhereTheyMeetInEveryColumnOfPixels) {
  // A nosing that climbs by a quarter of a row per pixel.
  set_plane(1, Vec3{0.2, -0.86, -0.5}, {0.0, 0.0, 1.2});
  set_plane(2, Vec3{0.0, 0.45, -0.89}, {0.0, 0.0, 1.2});
  const Vec3 d = (*regions_)[2].plane.m - (*regions_)[1].plane.m;
  const auto meeting_row = [&](double column) {
    return 240.0 - 400.0 * (d.x() * (column - 320.0) / 400.0 + d.z()) / d.y();
  };
  ASSERT_GT(std::abs(meeting_row(324.0) - meeting_row(320.0)), 0.4);
  int wrong = 0, wrong_by_columns = 0;
  for (std::int32_t g = 35; g < 45; ++g) {
    const auto last = static_cast<std::int32_t>(std::ceil(meeting_row(8 * g + 3.5))) - 1;
    own(1, g, last - 40, last);
    own(2, g, last + 1, last + 40);
    for (std::int32_t c = 8 * g; c < 8 * g + 8; ++c) {
      for (std::int32_t r = last - 6; r <= last + 6; ++r) {
        const std::size_t truth = r < meeting_row(c) ? 1U : 2U;
        wrong += label(c, r) != truth ? 1 : 0;
        wrong_by_columns += regions_->labels.at(g, r) != truth ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(wrong_by_columns, 20);
}

TEST_F(PixelLabelsTest, ATreadWithANosing_EndsAtItAndBesideItWhereThePlanesMeet) {
  set_plane(1, Vec3{0.0, -0.86, -0.5}, {0.0, 0.0, 1.2});
  set_plane(2, Vec3{0.0, 0.45, -0.89}, {0.0, 0.0, 1.2});  // they meet in row 240
  (*regions_)[1].kind = SurfaceKind::kTread;
  (*regions_)[2].kind = SurfaceKind::kRiser;
  for (std::int32_t g = 35; g < 45; ++g) own(1, g, 200, 239), own(2, g, 240, 280);
  // Beyond those rows by 1.4 to 2.6 px, from pixel 304 to 336.
  const auto on_tread = [&](double column, double row) -> Vec3 {
    return Vec3{(column - 320.0) / 400.0, (row - 240.0) / 400.0, 1.0} / inverse_depth(1, column, row);
  };
  EdgeLine& nosing = (*published_)[1].nosing;
  nosing = {on_tread(304.0, 241.4), on_tread(336.0, 242.6), 0.001, true};
  EXPECT_EQ(label(306, 241), 1U);
  EXPECT_EQ(label(306, 242), 2U);
  EXPECT_EQ(label(334, 242), 1U);
  EXPECT_EQ(label(334, 243), 2U);
  EXPECT_EQ(label(302, 241), 2U) << "beside its end";
  std::swap(nosing.a_m, nosing.b_m);
  EXPECT_EQ(label(334, 242), 1U);
  (*regions_)[2].kind = SurfaceKind::kOther;
  EXPECT_EQ(label(334, 242), 2U) << "no nosing without a riser";
  (*regions_)[2].kind = SurfaceKind::kRiser;
  nosing = {on_tread(304.0, 245.0), on_tread(336.0, 245.0), 0.001, true};
  EXPECT_EQ(label(320, 242), 2U) << "another edge than the one that ends these rows";
}

TEST_F(PixelLabelsTest, AColumnOfTwoThings_IsTheSurfacesUpToWhereItsPixelsLeaveIt) {
  set_plane(1, Vec3{0.0, 0.0, -1.0}, {0.0, 0.0, 1.0});
  set_plane(2, Vec3{0.0, 0.0, -1.0}, {0.0, 0.0, 1.5});
  own(1, 39, 200, 260);  // up to pixel 319; of the next column three pixels more
  for (std::int32_t r = 200; r <= 260; ++r) {
    for (std::int32_t c = 300; c < 340; ++c) see(c < 323 ? 1 : 2, c, r);
  }
  EXPECT_EQ(label(322, 230), 1U);
  EXPECT_EQ(label(323, 230), 0U);
  see(1, 326, 230);  // a pixel beyond what has left the surface says nothing
  EXPECT_EQ(label(326, 230), 0U);
  // The column itself says in which rows the surface ends.
  own(1, 40, 200, 225);
  EXPECT_EQ(label(322, 230), 0U);
  // Without depths it is nobody's.
  raw_.depth = nullptr;
  EXPECT_EQ(label(322, 245), 0U);
}

TEST_F(PixelLabelsTest, APixelOfTheRobotsOwnBody_IsNoSurfaces) {
  set_plane(1, Vec3{0.0, 0.0, -1.0}, {0.0, 0.0, 1.0});
  own(1, 39, 200, 260);
  for (std::int32_t r = 200; r <= 260; ++r) {
    for (std::int32_t c = 300; c < 328; ++c) see(1, c, r);
  }
  picture_->flags(322 / 2, 230 / 2) = kPixelBody;
  EXPECT_EQ(label(322, 230), 1U);  // of some picture before: rows without body are not written
  picture_->body_rows[230 / 2] = true;
  EXPECT_EQ(label(322, 230), 0U);
  EXPECT_EQ(label(322, 232), 1U);
  EXPECT_EQ(label(324, 230), 0U);  // two off: what lies behind the body has left the surface
}

}  // namespace
}  // namespace polygmap
