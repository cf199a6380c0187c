// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/regions.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

namespace polygmap {
namespace {

// Flood fill, the plain way.
std::vector<int> oracle(const std::vector<int>& values, int width, int height) {
  std::vector<int> label(values.size(), 0);
  int next = 0;
  for (std::size_t seed = 0; seed < values.size(); ++seed) {
    if (values[seed] == 0 || label[seed] != 0) continue;
    label[seed] = ++next;
    std::vector<std::size_t> stack{seed};
    while (!stack.empty()) {
      const std::size_t i = stack.back();
      stack.pop_back();
      const int c = static_cast<int>(i) % width, r = static_cast<int>(i) / width;
      for (const auto& [dc, dr] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (c + dc < 0 || c + dc >= width || r + dr < 0 || r + dr >= height) continue;
        const auto j = static_cast<std::size_t>((r + dr) * width + c + dc);
        if (values[j] != values[i] || label[j] != 0) continue;
        label[j] = next;
        stack.push_back(j);
      }
    }
  }
  return label;
}

void run(RegionLabelling& stage, const std::vector<int>& values, int width, int height, std::uint32_t min_area) {
  const auto at = [&](std::int32_t c, std::int32_t r) { return values[static_cast<std::size_t>(r * width + c)]; };
  stage.begin();
  for (int r = 0; r < height; ++r) {
    stage.scan_row(
        r, width, [&](std::int32_t c, std::int32_t row) { return at(c, row) != 0; },
        [&](std::int32_t c0, std::int32_t r0, std::int32_t c1, std::int32_t r1) { return at(c0, r0) == at(c1, r1); });
  }
  stage.resolve(min_area);
  for (int r = 0; r < height; ++r) stage.label_row(r, width);
}

TEST(Regions, RandomPictures_LargestRegions_AgreeWithFloodFill) {
  auto stage = std::make_unique<RegionLabelling>();
  std::mt19937 random(7);
  for (int trial = 0; trial < 60; ++trial) {
    const int width = 40, height = 30;
    std::vector<int> values(static_cast<std::size_t>(width * height));
    for (int& v : values) v = std::uniform_int_distribution<>(0, 2)(random);
    const std::vector<int> expected = oracle(values, width, height);
    run(*stage, values, width, height, 5);
    std::vector<std::uint32_t> area(static_cast<std::size_t>(width * height) + 1, 0);
    for (const int l : expected) ++area[static_cast<std::size_t>(l)];
    std::vector<int> mate(RegionLabelling::kMaxRegions + 1, 0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::uint16_t got = stage->labels()(static_cast<int>(i) % width, static_cast<int>(i) / width);
      const auto truth = static_cast<std::size_t>(expected[i]);
      if (got == 0) {
        // Dropped: background, too small, or smaller than the smallest that found room.
        EXPECT_TRUE(truth == 0 || area[truth] < 5 ||
                    (stage->region_count() == RegionLabelling::kMaxRegions &&
                     area[truth] <= stage->region(RegionLabelling::kMaxRegions).area_px));
        continue;
      }
      if (mate[got] == 0) mate[got] = static_cast<int>(truth);
      ASSERT_EQ(mate[got], static_cast<int>(truth));
      ASSERT_EQ(stage->region(got).area_px, area[truth]);
    }
    for (std::size_t k = 2; k <= stage->region_count(); ++k) {
      EXPECT_GE(stage->region(k - 1).area_px, stage->region(k).area_px);
    }
  }
}

TEST(Regions, ProvisionalLabelsRunOut_SaysSoAndGoesOn) {
  auto stage = std::make_unique<RegionLabelling>();
  std::vector<int> values(static_cast<std::size_t>(kHalfWidth_px * kHalfHeight_px), 0);
  for (int r = 0; r < kHalfHeight_px; ++r) {
    for (int c = 0; c < kHalfWidth_px; ++c) {
      values[static_cast<std::size_t>(r * kHalfWidth_px + c)] = (r < 200 ? (r + c) % 2 : 1);
    }
  }
  run(*stage, values, kHalfWidth_px, kHalfHeight_px, 1);
  EXPECT_GT(stage->overflow(), 0U);
  EXPECT_LE(stage->region_count(), RegionLabelling::kMaxRegions);
}

}  // namespace
}  // namespace polygmap
