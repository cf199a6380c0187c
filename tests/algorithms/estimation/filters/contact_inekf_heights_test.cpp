// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "algorithms/estimation/filters/contact_inekf.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

constexpr double kCorrelation_s = 1.0, kFoot_m = 1e-3, kHeightSigma_m = 0.01;

// A base 0.8 m above its contacts, which are at height 0, where nothing moves. Height and place are known by 20 mm.
class ContactInEkfHeights : public testing::Test {
 protected:
  ContactInEkfHeights() {
    params_.foot_sigma_m = kFoot_m;
    params_.height_correlation_s = kCorrelation_s;
    start_.odom_p_base_m = {0.0, 0.0, 0.8};
    start_.position_sigma_m = 0.02;
    start_.tilt_sigma_rad = start_.yaw_sigma_rad = 1e-6;
    for (std::size_t foot = 0; foot < kFootCount; ++foot) {
      legs_[foot].base_T_sole.p_m = {0.0, foot == 0 ? 0.1 : -0.1, -0.8};
      contacts_[foot].stands = true;
    }
    initialise();
  }
  void initialise() {
    filter_.reset(params_);
    filter_.initialise(start_, legs_);
  }
  // dt_s of the height's correlation: the row counts in full.
  void correct_left(double odom_z_m, double sigma_m = kHeightSigma_m, double dt_s = kCorrelation_s) {
    filter_.correct_by_heights({{{odom_z_m, sigma_m}, {}}}, contacts_, dt_s);
  }
  [[nodiscard]] double height_variance_m2() const { return filter_.covariance()(2, 2); }
  // As a copy of the filter says when it is told of a height 100 m below that nobody knows.
  [[nodiscard]] double contact_z_m(std::size_t foot) const {
    ContactInEkf copy = filter_;
    std::array<KnownHeight, kFootCount> heights;
    heights[foot] = {-100.0, 1e3};
    copy.correct_by_heights(heights, contacts_, kCorrelation_s);
    return std::sqrt(copy.height_rows().sum) * 1e3 - 100.0;
  }
  ContactInEkf::Params params_;
  ContactInEkf::Start start_;
  std::array<LegMeasurement, kFootCount> legs_;
  std::array<FootContact, kFootCount> contacts_;
  ContactInEkf filter_;
};

TEST_F(ContactInEkfHeights, KnownHeight_PullsContactsAndBaseByWhatIsLessSure) {
  correct_left(0.03);
  const double contact_m2 = 4e-4 + 1e-6, all_m2 = contact_m2 + 1e-4;  // of the contact; of the innovation
  EXPECT_NEAR(filter_.height_rows().sum, 9e-4 / all_m2, 1e-6);
  EXPECT_EQ(filter_.height_rows().rows, 1U);
  EXPECT_NEAR(filter_.odom_p_base_m().z(), 0.8 + 0.03 * 4e-4 / all_m2, 1e-7);
  EXPECT_NEAR(contact_z_m(0), 0.03 * contact_m2 / all_m2, 1e-7);
  EXPECT_NEAR(contact_z_m(1), 0.03 * 4e-4 / all_m2, 1e-7);  // through the base
  EXPECT_LT(filter_.odom_p_base_m().head<2>().norm(), 1e-7);
  EXPECT_NEAR(height_variance_m2(), 4e-4 - 16e-8 / all_m2, 1e-9);
  EXPECT_NEAR(filter_.covariance()(0, 0), 4e-4, 1e-9);
}

TEST_F(ContactInEkfHeights, BothFeet_OneRowEach) {
  filter_.correct_by_heights({{{0.03, kHeightSigma_m}, {-0.03, kHeightSigma_m}}}, contacts_, kCorrelation_s);
  EXPECT_EQ(filter_.height_rows().rows, 2U);
  EXPECT_GT(contact_z_m(0), contact_z_m(1));
  EXPECT_LT(std::abs(filter_.odom_p_base_m().z() - 0.8), 1e-3);  // they contradict each other
}

TEST_F(ContactInEkfHeights, HeightUnknown_DoesNothing) {
  correct_left(0.03, -1.0);
  EXPECT_EQ(filter_.height_rows().rows, 0U);
  EXPECT_EQ(filter_.odom_p_base_m().z(), 0.8);
  const ContactInEkf before = filter_;
  filter_.correct_by_heights({}, contacts_, kCorrelation_s);
  EXPECT_EQ(filter_.height_rows().rows, 0U);
  EXPECT_EQ(filter_.covariance(), before.covariance());
}

TEST_F(ContactInEkfHeights, FootInTheAirOrJustLanded_DoesNothing) {
  const auto before = filter_.covariance();
  contacts_[0].stands = false;
  correct_left(0.03);
  EXPECT_EQ(filter_.height_rows().rows, 0U);
  contacts_[0].stands = contacts_[0].landed = true;
  correct_left(0.03);
  EXPECT_EQ(filter_.height_rows().rows, 0U);
  EXPECT_EQ(filter_.odom_p_base_m().z(), 0.8);
  EXPECT_EQ(filter_.covariance(), before);
}

// One height errs alike in all of its rows: in a second, at any rate, it is worth what one of its sigma is.
TEST_F(ContactInEkfHeights, RepeatedRows_SigmaIsNoLessThanTheHeights) {
  start_.position_sigma_m = 0.5;
  for (const int rate_hz : {200, 500, 1000}) {
    initialise();
    for (int i = 0; i < rate_hz; ++i) correct_left(0.0, kHeightSigma_m, 1.0 / rate_hz);
    EXPECT_NEAR(height_variance_m2(), 0.25 * (1e-6 + 1e-4) / (0.25 + 1e-6 + 1e-4), 1e-9) << rate_hz;
    EXPECT_GT(std::sqrt(height_variance_m2()), kHeightSigma_m) << rate_hz;
  }
}

TEST_F(ContactInEkfHeights, TiltUnsure_HeightOfAFootFarFromTheBaseTiltsIt) {
  start_.odom_p_base_m.setZero();
  start_.position_sigma_m = 1e-5;
  start_.tilt_sigma_rad = 0.1;
  legs_[0].base_T_sole.p_m = {0.5, 0.0, -0.8};
  initialise();
  correct_left(-0.79, 1e-4);
  EXPECT_NEAR(filter_.odom_R_base()(2, 0), 0.02, 1e-4);  // 10 mm at 0.5 m ahead
  EXPECT_NEAR(filter_.odom_R_base()(2, 1), 0.0, 1e-4);
  legs_[0].base_T_sole.p_m = {0.0, 0.5, -0.8};
  initialise();
  correct_left(-0.79, 1e-4);
  EXPECT_NEAR(filter_.odom_R_base()(2, 0), 0.0, 1e-4);
  EXPECT_NEAR(filter_.odom_R_base()(2, 1), 0.02, 1e-4);  // and to the left
}

}  // namespace
}  // namespace polygmap
