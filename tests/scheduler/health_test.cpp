// SPDX-License-Identifier: Apache-2.0
#include "scheduler/health.hpp"

#include <gtest/gtest.h>

namespace polygmap {
namespace {

template <typename Code>
class HealthCodes : public ::testing::Test {
 public:
  static Code at(std::size_t i) { return static_cast<Code>(kFirstCode<Code> + i); }
};
using CodeTypes = ::testing::Types<Fault, Limit>;
TYPED_TEST_SUITE(HealthCodes, CodeTypes);

TYPED_TEST(HealthCodes, Raise_EachCode_CountsThatOneAlone) {
  for (std::size_t i = 0; i < kCodeCount<TypeParam>; ++i) {
    Health health;
    health.raise(this->at(i), 10);
    health.raise(this->at(i), 30);
    for (std::size_t j = 0; j < kCodeCount<TypeParam>; ++j) {
      EXPECT_EQ(health.count(this->at(j)).count, i == j ? 2U : 0U);
    }
    EXPECT_EQ(health.count(this->at(i)).first_ns, 10);
    EXPECT_EQ(health.count(this->at(i)).last_ns, 30);
    EXPECT_EQ(health.any_fault(), (std::is_same_v<TypeParam, Fault>));
    EXPECT_EQ(health.any_limit(), (std::is_same_v<TypeParam, Limit>));
    health.clear(this->at(i));
    EXPECT_EQ(health.count(this->at(i)).count, 0U);
    EXPECT_FALSE(health.any_fault() || health.any_limit());
  }
}

TYPED_TEST(HealthCodes, NameOf_EachCode_IsItsOwn) {
  for (std::size_t i = 0; i < kCodeCount<TypeParam>; ++i) {
    EXPECT_FALSE(name_of(this->at(i)).empty());
    EXPECT_NE(name_of(this->at(i)), "unknown");
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(name_of(this->at(i)), name_of(this->at(j)));
  }
  EXPECT_EQ(name_of(TypeParam::kEnd), "unknown");
  EXPECT_EQ(name_of(static_cast<TypeParam>(0)), "unknown");
}

TYPED_TEST(HealthCodes, Raise_OutsideTheEnumeration_ChangesNothing) {
  Health health;
  for (const int code : {0, static_cast<int>(TypeParam::kEnd), 255}) {
    health.raise(static_cast<TypeParam>(code), 1);
    EXPECT_EQ(health.count(static_cast<TypeParam>(code)).count, 0U);
  }
  EXPECT_FALSE(health.any_fault() || health.any_limit());
}

TYPED_TEST(HealthCodes, Raise_ManyTimes_Saturates) {
  Health health;
  health.raise(this->at(0), 1, UINT32_MAX - 1);
  health.raise(this->at(0), 2, 5);
  EXPECT_EQ(health.count(this->at(0)).count, UINT32_MAX);
  health.raise(this->at(1), 3, 0);
  EXPECT_EQ(health.count(this->at(1)).count, 0U);
}

TYPED_TEST(HealthCodes, Merge_TwoLanes_AddsCountsAndWidensTheStamps) {
  Health a, b;
  a.raise(this->at(0), 10);
  b.raise(this->at(0), 5, 2);
  b.raise(this->at(1), 7);
  a.merge(b);
  EXPECT_EQ(a.count(this->at(0)).count, 3U);
  EXPECT_EQ(a.count(this->at(0)).first_ns, 5);
  EXPECT_EQ(a.count(this->at(0)).last_ns, 10);
  EXPECT_EQ(a.count(this->at(1)).first_ns, 7);
  a.clear();
  EXPECT_FALSE(a.any_fault() || a.any_limit());
}

TEST(HealthCodesApart, FaultsAndLimits_ShareNoNumber) {
  EXPECT_LT(static_cast<int>(Fault::kEnd), 100);
  EXPECT_GT(static_cast<int>(Limit::kRowShed), 100);
}

}  // namespace
}  // namespace polygmap
