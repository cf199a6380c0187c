// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/paper_route/contour.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <set>

namespace polygmap {
namespace {

using Labels = HalfImage<std::uint16_t>;

struct Tracer {
  std::unique_ptr<Labels> labels = std::make_unique<Labels>();
  std::unique_ptr<Contour> contour = std::make_unique<Contour>();
  std::unique_ptr<ConvexOutline> hull = std::make_unique<ConvexOutline>();

  bool trace() {
    for (std::int16_t r = 0; r < kHalfHeight_px; ++r) {
      for (std::int16_t c = 0; c < kHalfWidth_px; ++c) {
        if ((*labels)(c, r) == 1) return try_trace_contour(*labels, 1, {c, r}, kHalfWidth_px, kHalfHeight_px, *contour);
      }
    }
    return false;
  }
};

TEST(Contour, Rectangle_IsItsBorderOnce) {
  Tracer t;
  for (int r = 10; r < 15; ++r) {
    for (int c = 20; c < 28; ++c) (*t.labels)(c, r) = 1;
  }
  ASSERT_TRUE(t.trace());
  EXPECT_EQ(t.contour->size(), 2U * (8 + 5) - 4U);
}

TEST(Contour, SinglePixelAndLine_AreClosed) {
  Tracer t;
  (*t.labels)(5, 5) = 1;
  ASSERT_TRUE(t.trace());
  EXPECT_EQ(t.contour->size(), 1U);
  for (int c = 5; c < 10; ++c) (*t.labels)(c, 5) = 1;
  ASSERT_TRUE(t.trace());
  EXPECT_EQ(t.contour->size(), 8U);  // there and back
}

TEST(Contour, RandomRegions_ContourIsExactlyTheOuterBorder) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 40; ++trial) {
    Tracer t;
    // A blob grown from one pixel.
    (*t.labels)(60, 60) = 1;
    for (int i = 0; i < 3000; ++i) {
      const int c = std::uniform_int_distribution<>(45, 75)(random),
                r = std::uniform_int_distribution<>(45, 75)(random);
      if ((*t.labels)(c + 1, r) == 1 || (*t.labels)(c - 1, r) == 1 || (*t.labels)(c, r + 1) == 1 ||
          (*t.labels)(c, r - 1) == 1) {
        (*t.labels)(c, r) = 1;
      }
    }
    ASSERT_TRUE(t.trace());
    // Outside, 4-connected from a corner; border: region pixels that touch it.
    auto outside = std::make_unique<HalfImage<std::uint8_t>>();
    for (int pass = 0; pass < 60; ++pass) {
      for (int r = 30; r < 90; ++r) {
        for (int c = 30; c < 90; ++c) {
          const bool edge = r == 30 || c == 30;
          if ((*t.labels)(c, r) == 0 && (edge || (*outside)(c - 1, r) != 0 || (*outside)(c, r - 1) != 0 ||
                                         (*outside)(c + 1, r) != 0 || (*outside)(c, r + 1) != 0)) {
            (*outside)(c, r) = 1;
          }
        }
      }
    }
    std::set<std::pair<int, int>> expected, got;
    for (int r = 31; r < 89; ++r) {
      for (int c = 31; c < 89; ++c) {
        if ((*t.labels)(c, r) == 1 && ((*outside)(c - 1, r) != 0 || (*outside)(c + 1, r) != 0 ||
                                       (*outside)(c, r - 1) != 0 || (*outside)(c, r + 1) != 0)) {
          expected.insert({c, r});
        }
      }
    }
    for (const ContourPixel& p : *t.contour) got.insert({p.column, p.row});
    EXPECT_EQ(got, expected);
  }
}

TEST(ConvexOutline, Disc_ContainsEveryPixelWithinTheVertexLimit) {
  Tracer t;
  for (int r = 0; r < kHalfHeight_px; ++r) {
    for (int c = 0; c < kHalfWidth_px; ++c) {
      if ((c - 150) * (c - 150) + (r - 100) * (r - 100) < 60 * 60) (*t.labels)(c, r) = 1;
    }
  }
  ASSERT_TRUE(t.trace());
  t.hull->begin();
  t.hull->add(*t.contour);
  Outline2 full, reduced;
  t.hull->build(kMaxOutline, full);
  t.hull->build(16, reduced);
  EXPECT_LE(reduced.size(), 16U);
  const double area = 0.5 * std::abs(twice_area(full));
  EXPECT_NEAR(area, kPi * 60 * 60, 0.02 * kPi * 60 * 60);
  EXPECT_LT(0.5 * std::abs(twice_area(reduced)), area + 1e-9);
  EXPECT_GT(0.5 * std::abs(twice_area(reduced)), 0.95 * area);
  // Convex, always turning the same way.
  for (std::size_t i = 0; i < full.size(); ++i) {
    const Vec2 &a = full[i], &b = full[(i + 1) % full.size()], &c = full[(i + 2) % full.size()];
    EXPECT_GT((b - a).x() * (c - b).y() - (b - a).y() * (c - b).x(), 0.0);
  }
  for (const ContourPixel& p : *t.contour) {
    for (std::size_t i = 0; i < full.size() && full.size() < kMaxOutline; ++i) {
      const Vec2 edge = full[(i + 1) % full.size()] - full[i], to = Vec2{p.column, p.row} - full[i];
      EXPECT_GT(edge.x() * to.y() - edge.y() * to.x(), -1e-9);
    }
  }
}

TEST(ConvexOutline, TwoPieces_AreSpannedTogether) {
  Tracer t;
  for (int r = 50; r < 60; ++r) {
    for (int c = 20; c < 30; ++c) (*t.labels)(c, r) = 1;
  }
  ASSERT_TRUE(t.trace());
  t.hull->begin();
  t.hull->add(*t.contour);
  Contour other;
  ASSERT_TRUE(other.try_push_back({100, 55}));
  t.hull->add(other);
  Outline2 outline;
  t.hull->build(24, outline);
  double right = 0.0;
  for (const Vec2& p : outline) right = std::max(right, p.x());
  EXPECT_DOUBLE_EQ(right, 100.5);
}

}  // namespace
}  // namespace polygmap
