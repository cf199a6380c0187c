// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "algorithms/core/containers/raster.hpp"
#include "algorithms/core/containers/ring_buffer.hpp"
#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/math/math.hpp"
#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/work.hpp"

namespace polygmap {
namespace {

constexpr int kOperations = 1'000'000;

// Compile-time use: the same code, evaluated by the compiler.
consteval bool static_vector_works() {
  StaticVector<int, 3> v;
  bool ok = v.empty() && !v.try_pop_back() && v.try_push_back(1) && v.try_push_back(2) && v.try_push_back(3);
  ok = ok && v.full() && !v.try_push_back(4) && v.size() == 3 && v.front() == 1 && v.back() == 3;
  ok = ok && v.try_swap_remove(0) && v[0] == 3 && !v.try_swap_remove(2) && !v.try_resize(4) && v.try_resize(3);
  int sum = 0;
  for (const int x : v) sum += x;
  v.clear();
  return ok && sum == 5 && v.empty() && v.capacity() == 3;
}
static_assert(static_vector_works());

consteval bool ring_buffer_works() {
  RingBuffer<int, 2> r;
  int out = -1;
  bool ok = r.empty() && !r.try_pop(out) && out == -1 && r.try_push(1) && r.try_push(2) && !r.try_push(3) && r.full();
  r.push_overwrite(4);
  ok = ok && r.oldest() == 2 && r.newest() == 4 && r[1] == 4 && r.try_pop(out) && out == 2 && r.size() == 1;
  r.clear();
  return ok && r.empty() && r.capacity() == 2;
}
static_assert(ring_buffer_works());

consteval bool raster_works() {
  Raster<int, 3, 2> r;
  r.fill(7);
  r(2, 1) = 9;
  int out = 0;
  bool ok = r.try_get(2, 1, out) && out == 9 && r.row(1)[2] == 9 && r.data()[5] == 9 && r(0, 0) == 7;
  ok = ok && !r.try_get(3, 1, out) && !r.try_get(0, 2, out) && !r.try_get(-1, 0, out) && !r.try_get(0, -1, out);
  return ok && out == 9 && r.size() == 6;
}
static_assert(raster_works());

consteval bool work_budget_works() {
  WorkBudget budget(10);
  budget.spend(4);
  bool ok = budget.left() == 6 && !budget.exhausted();
  budget.spend(-3);  // work never earns units
  ok = ok && budget.left() == 6;
  budget.spend(6);
  ok = ok && budget.exhausted();
  for (int i = 0; i < 3; ++i) budget.spend(std::numeric_limits<std::int32_t>::max());
  return ok && budget.left() == -std::numeric_limits<std::int32_t>::max();
}
static_assert(work_budget_works());

static_assert(std::is_trivially_copyable_v<StaticVector<int, 4>> && std::is_trivially_copyable_v<RingBuffer<int, 4>>);
static_assert(sizeof(Raster<std::uint16_t, 5, 3>) == 30, "no padding: a raster is an image");

struct Pair {  // more than one word, so that a half-copied element shows
  std::uint64_t a = 0;
  std::uint64_t b = 0;
  bool operator==(const Pair&) const = default;
};

template <std::size_t Capacity>
void compare_static_vector_with_std(std::uint32_t seed) {
  std::mt19937 random(seed);
  StaticVector<Pair, Capacity> ours;
  std::vector<Pair> theirs;
  std::uint64_t refused = 0;
  for (int i = 0; i < kOperations; ++i) {
    const auto dice = static_cast<std::uint32_t>(random());
    const Pair value{random(), static_cast<std::uint64_t>(i)};
    const std::size_t place = dice % (Capacity + 2);
    switch ((dice >> 16) % 16) {
      case 0: {
        const bool fits = place <= Capacity;
        ASSERT_EQ(ours.try_resize(place), fits);
        if (fits) theirs.resize(place);
        break;
      }
      case 1: {
        const bool inside = place < theirs.size();
        ASSERT_EQ(ours.try_swap_remove(place), inside);
        if (inside) {
          theirs[place] = theirs.back();
          theirs.pop_back();
        }
        break;
      }
      case 2:
        if (dice % 1024 == 0) {
          ours.clear();
          theirs.clear();
        }
        break;
      case 3:
        if (!theirs.empty()) theirs[place % theirs.size()] = ours[place % ours.size()] = value;
        break;
      case 4: {
        const StaticVector<Pair, Capacity> copy = ours;  // a copy is a value of its own
        ours.clear();
        ours = copy;
        break;
      }
      case 5:
      case 6:
      case 7:
      case 8:
      case 9:
        ASSERT_EQ(ours.try_pop_back(), !theirs.empty());
        if (!theirs.empty()) theirs.pop_back();
        break;
      default: {
        const bool fits = theirs.size() < Capacity;
        ASSERT_EQ(ours.try_push_back(value), fits);
        if (fits) theirs.push_back(value);
        refused += fits ? 0 : 1;
      }
    }
    ASSERT_EQ(ours.size(), theirs.size());
    ASSERT_EQ(ours.full(), theirs.size() == Capacity);
    if (!theirs.empty()) {
      ASSERT_EQ(ours.back(), theirs.back());
      ASSERT_EQ(ours.front(), theirs.front());
    }
    if (i % 16 == 0) {
      ASSERT_TRUE(std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end()));
    }
  }
  EXPECT_GT(refused, 1000U);
}

TEST(StaticVector, RandomOperations_AgainstStdVector_AgreeAlways) {
  compare_static_vector_with_std<1>(1);
  compare_static_vector_with_std<7>(2);
  compare_static_vector_with_std<24>(3);
}

TEST(StaticVector, TryPushBack_ItsOwnElement_CopiesIt) {
  StaticVector<Pair, 4> v;
  ASSERT_TRUE(v.try_push_back({1, 2}));
  ASSERT_TRUE(v.try_push_back(v[0]));
  EXPECT_EQ(v[1], (Pair{1, 2}));
}

TEST(StaticVector, TryResize_AfterShrinking_ShowsFreshElementsNotOldOnes) {
  StaticVector<Pair, 4> v;
  ASSERT_TRUE(v.try_push_back({1, 2}));
  ASSERT_TRUE(v.try_resize(0));
  ASSERT_TRUE(v.try_resize(1));
  EXPECT_EQ(v[0], Pair{});
}

template <std::size_t Capacity>
void compare_ring_buffer_with_std(std::uint32_t seed) {
  std::mt19937 random(seed);
  RingBuffer<Pair, Capacity> ours;
  std::deque<Pair> theirs;
  std::uint64_t overwritten = 0;
  for (int i = 0; i < kOperations; ++i) {
    const auto dice = static_cast<std::uint32_t>(random());
    const Pair value{dice, static_cast<std::uint64_t>(i)};
    switch ((dice >> 16) % 8) {
      case 0:
      case 1:
        if (theirs.size() == Capacity) {
          theirs.pop_front();
          ++overwritten;
        }
        theirs.push_back(value);
        ours.push_overwrite(value);
        break;
      case 2:
      case 3: {
        const bool fits = theirs.size() < Capacity;
        ASSERT_EQ(ours.try_push(value), fits);
        if (fits) theirs.push_back(value);
        break;
      }
      case 4:
        if (dice % 1024 == 0) {
          ours.clear();
          theirs.clear();
        }
        break;
      default: {
        Pair out = value;
        ASSERT_EQ(ours.try_pop(out), !theirs.empty());
        ASSERT_EQ(out, theirs.empty() ? value : theirs.front());
        if (!theirs.empty()) theirs.pop_front();
      }
    }
    ASSERT_EQ(ours.size(), theirs.size());
    ASSERT_EQ(ours.empty(), theirs.empty());
    ASSERT_EQ(ours.full(), theirs.size() == Capacity);
    if (!theirs.empty()) {
      ASSERT_EQ(ours.oldest(), theirs.front());
      ASSERT_EQ(ours.newest(), theirs.back());
      const std::size_t place = dice % theirs.size();
      ASSERT_EQ(ours[place], theirs[place]);
    }
  }
  EXPECT_GT(overwritten, 1000U);
}

TEST(RingBuffer, RandomOperations_AgainstStdDeque_AgreeAlways) {
  compare_ring_buffer_with_std<1>(1);
  compare_ring_buffer_with_std<7>(2);
  compare_ring_buffer_with_std<32>(3);
}

TEST(RingBuffer, ReplaceNewest_ChangesTheLastAloneAlsoWhereTheRingWraps) {
  RingBuffer<int, 3> r;
  for (int i = 1; i <= 4; ++i) r.push_overwrite(i);
  r.replace_newest(9);
  EXPECT_EQ(r.size(), 3U);
  EXPECT_EQ(r.oldest(), 2);
  EXPECT_EQ(r[1], 3);
  EXPECT_EQ(r.newest(), 9);
}

TEST(RingBuffer, PushOverwrite_ItsOwnOldestElementWhenFull_KeepsItsValue) {
  RingBuffer<Pair, 2> r;
  r.push_overwrite({1, 1});
  r.push_overwrite({2, 2});
  r.push_overwrite(r.oldest());
  EXPECT_EQ(r.oldest(), (Pair{2, 2}));
  EXPECT_EQ(r.newest(), (Pair{1, 1}));
}

TEST(Raster, RandomWrites_AgainstStdVector_AgreeInEveryCell) {
  constexpr std::int32_t kWidth = 37;
  constexpr std::int32_t kHeight = 19;
  std::mt19937 random(4);
  const auto ours = std::make_unique<Raster<std::uint32_t, kWidth, kHeight>>();
  std::vector<std::vector<std::uint32_t>> theirs(kHeight, std::vector<std::uint32_t>(kWidth, 0));
  for (int i = 0; i < kOperations; ++i) {
    const auto column = static_cast<std::int32_t>(random() % (kWidth + 4)) - 2;
    const auto row = static_cast<std::int32_t>(random() % (kHeight + 4)) - 2;
    const bool inside = column >= 0 && column < kWidth && row >= 0 && row < kHeight;
    ASSERT_EQ(ours->contains(column, row), inside);
    std::uint32_t out = 0xDEAD;
    ASSERT_EQ(ours->try_get(column, row, out), inside);
    if (!inside) {
      ASSERT_EQ(out, 0xDEADU);
      continue;
    }
    std::uint32_t& cell = theirs[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
    ASSERT_EQ(out, cell);
    ASSERT_EQ(ours->row(row)[column], cell);
    (*ours)(column, row) = cell = static_cast<std::uint32_t>(random());
  }
  for (std::int32_t row = 0; row < kHeight; ++row) {
    for (std::int32_t column = 0; column < kWidth; ++column) {
      ASSERT_EQ(ours->data()[row * kWidth + column],
                theirs[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)]);
    }
  }
}

TEST(WrapAngle, RandomAngles_StaysInTheIntervalAndKeepsTheDirection) {
  std::mt19937 random(5);
  for (int i = 0; i < 200'000; ++i) {
    const double angle_rad = std::uniform_real_distribution<>(-1e4, 1e4)(random);
    const double wrapped_rad = math::wrap_angle(angle_rad);
    ASSERT_GT(wrapped_rad, -kPi);
    ASSERT_LE(wrapped_rad, kPi);
    ASSERT_NEAR(std::remainder(angle_rad - wrapped_rad, 2.0 * kPi), 0.0, 1e-11);
  }
}

TEST(WrapAngle, NextToOddMultiplesOfPi_StaysInTheInterval) {
  std::mt19937 random(6);
  for (int i = 0; i < 200'000; ++i) {
    double angle_rad = (2.0 * std::floor(std::uniform_real_distribution<>(-1e5, 1e5)(random)) + 1.0) * kPi;
    const int ulps = static_cast<int>(random() % 7) - 3;
    for (int n = 0; n < std::abs(ulps); ++n) angle_rad = std::nextafter(angle_rad, ulps > 0 ? 1e9 : -1e9);
    const double wrapped_rad = math::wrap_angle(angle_rad);
    ASSERT_GT(wrapped_rad, -kPi) << angle_rad;
    ASSERT_LE(wrapped_rad, kPi) << angle_rad;
  }
  EXPECT_EQ(math::wrap_angle(kPi), kPi);
  EXPECT_EQ(math::wrap_angle(-kPi), kPi);
}

TEST(WrapAngle, NotFiniteOrHuge_GivesZero) {
  for (const double bad : {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN(), 1e6, -1e300}) {
    EXPECT_EQ(math::wrap_angle(bad), 0.0);
  }
}

static_assert(math::clamp(3.0, 0.0, 1.0) == 1.0 && math::clamp(-3.0, 0.0, 1.0) == 0.0 &&
              math::clamp(0.5, 0.0, 1.0) == 0.5);
static_assert(math::clamp(std::numeric_limits<double>::quiet_NaN(), -2.0, 1.0) == -2.0, "NaN becomes low");

TEST(AllFinite, OneBadElementAnywhere_IsFound) {
  for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    for (Eigen::Index i = 0; i < 9; ++i) {
      Mat3 m = Mat3::Ones();
      EXPECT_TRUE(math::all_finite(m));
      m(i % 3, i / 3) = bad;
      EXPECT_FALSE(math::all_finite(m));
      EXPECT_FALSE(math::all_finite(m.transpose()));
    }
  }
}

Transform random_transform(std::mt19937& random) {
  std::uniform_real_distribution<> uniform(-3.0, 3.0);
  return {rotation_z(uniform(random)) * rotation_y(uniform(random)) * rotation_x(uniform(random)),
          {uniform(random), uniform(random), uniform(random)}};
}

TEST(Transform, RandomPairs_AgreeWithEigensIsometry) {
  std::mt19937 random(7);
  const auto isometry = [](const Transform& t) {
    Eigen::Isometry3d i = Eigen::Isometry3d::Identity();
    i.linear() = t.R;
    i.translation() = t.p_m;
    return i;
  };
  for (int i = 0; i < 20'000; ++i) {
    const Transform a_T_b = random_transform(random);
    const Transform b_T_c = random_transform(random);
    const Vec3 c_p = random_transform(random).p_m;
    const Eigen::Isometry3d expected = isometry(a_T_b) * isometry(b_T_c);
    const Transform a_T_c = a_T_b * b_T_c;
    ASSERT_LT((a_T_c.R - expected.linear()).cwiseAbs().maxCoeff(), 1e-14);
    ASSERT_LT((a_T_c * c_p - expected * c_p).norm(), 1e-13);
    ASSERT_LT((a_T_c.inverse() * (a_T_b * (b_T_c * c_p)) - c_p).norm(), 1e-13);
  }
}

TEST(Rotations, AboutEachAxis_AgreeWithEigensAngleAxis) {
  for (double angle_rad = -4.0; angle_rad < 4.0; angle_rad += 0.01) {
    const auto about = [angle_rad](const Vec3& axis) -> Mat3 {
      return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
    };
    EXPECT_LT((rotation_x(angle_rad) - about(Vec3::UnitX())).norm(), 1e-15);
    EXPECT_LT((rotation_y(angle_rad) - about(Vec3::UnitY())).norm(), 1e-15);
    EXPECT_LT((rotation_z(angle_rad) - about(Vec3::UnitZ())).norm(), 1e-15);
    EXPECT_NEAR(yaw_of(rotation_z(angle_rad)), math::wrap_angle(angle_rad), 1e-15);
  }
}

#ifndef NDEBUG
TEST(ContainersDeathTest, OutOfRange_DebugBuild_Asserts) {
  StaticVector<int, 2> v;
  RingBuffer<int, 2> r;
  Raster<int, 2, 2> image;
  EXPECT_DEATH((void)v[0], "");
  EXPECT_DEATH((void)v.back(), "");
  EXPECT_DEATH((void)r.newest(), "");
  EXPECT_DEATH((void)image(2, 0), "");
  EXPECT_DEATH((void)image.row(2), "");
}
#endif

}  // namespace
}  // namespace polygmap
