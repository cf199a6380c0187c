// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/inlier_ratio.hpp"

#include <algorithm>

namespace polygmap {

double inlier_ratio(const FrameImage& image, const RawImage& raw, const DepthNoiseModel& noise, const Regions& regions,
                    RegionId id, double sigmas) noexcept {
  constexpr std::int32_t kNextPixel = 3;  // across a column from sample to sample: all eight have their turn
  const CameraIntrinsics& k = raw.intrinsics;
  const Region& region = regions[id];
  const ColumnExtents& extents = regions.extents[id];
  const auto stride = std::max(1, static_cast<std::int32_t>(region.area_px / (kColumn_px * kInlierSamples_px)));
  const double most2 = sigmas * sigmas * region.plane.m.squaredNorm();
  std::int32_t seen = 0, on = 0, across = 0, skip = 0;
  for (std::int32_t g = extents.first_column; g <= extents.last_column; ++g) {
    const ColumnExtent& ends = extents.columns[static_cast<std::size_t>(g)];
    if (ends.empty()) continue;
    std::int32_t row = ends.top + skip;
    for (; row <= ends.bottom; row += stride) {
      across = (across + kNextPixel) % kColumn_px;
      const std::int32_t column = kColumn_px * g + across;
      const std::uint16_t value = raw.row(row)[column];
      // Which samples count is as good as random: nothing here branches on it.
      const bool own = regions.labels.at(g, row) == id, measured = raw.range.valid(value);
      const double w = 1.0 / (value * k.depth_unit_m);
      const Vec3 ray{(column - k.cx_px) / k.fx_px,
                     static_cast<double>(image.column_rays.y[static_cast<std::size_t>(row)]), 1.0};
      const double off = (w - region.plane.m.dot(ray)) * w;
      const int counts = static_cast<int>(own) & static_cast<int>(measured);
      seen += counts;
      on += counts & static_cast<int>(off * off < most2 * math::square(noise.inverse_sigma(w)));
    }
    skip = row - ends.bottom - 1;
  }
  return seen > 0 ? static_cast<double>(on) / seen : 1.0;
}

}  // namespace polygmap
