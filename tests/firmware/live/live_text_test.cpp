// SPDX-License-Identifier: Apache-2.0
// A view of known numbers as a table, as a line and as JSON, and how fast views follow each other.
#include "firmware/live/live_text.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace polygmap {
namespace {

void put(polygmap_mailbox_name& to, const char* name) { std::strncpy(to.text, name, sizeof to.text - 1); }

// A robot's, in the middle of its seventh step.
MailboxImage image_of_a_robot() {
  MailboxImage image;
  image.epoch_ns = 1'000'000'000;
  put(image.names.module_states[4], "climbing");
  put(image.names.gait_phases[2], "swing");
  put(image.names.stop_reasons[0], "none");
  put(image.names.arming_waits[0], "nothing");
  put(image.names.rows[0], "sense");
  put(image.names.rows[1], "surfaces");
  put(image.names.events[0], "imu_missing");
  put(image.names.events[1], "row_shed");
  image.names.event_numbers[0] = 5;
  image.names.event_numbers[1] = 101;
  image.names.row_budgets_us[0] = 120;
  image.names.row_budgets_us[1] = 840;
  image.status.stamp_ns = 11'000'000'000;
  image.status.cycles = 5000;
  image.status.module_state = 4;
  image.status.gait_phase = 2;
  image.status.treads_climbed = 3;
  image.status.step_sequence = 7;
  image.status.step_foot = 1;
  image.status.step_onto_tread = 1;
  image.status.picture_stamp_ns = 10'900'000'000;
  image.status.map_stamp_ns = 10'800'000'000;
  image.status.next[0].valid = 1;
  image.status.next[0].odom_p_sole_m[0] = 1.25;
  image.status.next[0].clearance_m = 0.021;
  image.status.next[0].toe_clearance_m = std::numeric_limits<double>::infinity();
  image.timing.row_count = 2;
  image.timing.lane_count = 1;
  image.timing.rows[0] = {
      .runs = 1000, .overruns = 0, .shed = 0, .robot = {20'000'000, 50'000, 100'000'000, 70'000}, .host = {}};
  image.timing.rows[1] = {
      .runs = 100, .overruns = 2, .shed = 4, .robot = {70'000'000, 900'000, 14'000'000, -60'000}, .host = {}};
  image.events.count[0] = 3;
  image.events.count[1] = 4;
  return image;
}
LiveView view_of(const MailboxImage& image) { return LiveMeter().view(image, 11'000'000'000, 0); }
bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

TEST(LiveView, RowsSlackAndWorstRow_AreByTheExecutivesCount) {
  const LiveView view = view_of(image_of_a_robot());
  ASSERT_EQ(view.rows.size(), 2U);
  EXPECT_DOUBLE_EQ(view.rows[0].robot.mean_us, 20.0);
  EXPECT_DOUBLE_EQ(view.rows[0].robot.worst_us, 50.0);
  EXPECT_DOUBLE_EQ(view.rows[0].robot.mean_slack_us, 100.0);
  EXPECT_DOUBLE_EQ(view.rows[0].robot.worst_slack_us, 70.0);
  EXPECT_EQ(view.worst_row, 1U);
  EXPECT_TRUE(std::isnan(view.rows[0].host.mean_us));
  EXPECT_DOUBLE_EQ(view.time_s, 10.0);
  EXPECT_NEAR(view.picture_age_s, 0.1, 1e-9);
  EXPECT_TRUE(std::isnan(view.lio_age_s)) << "there was none";
  EXPECT_FALSE(view.next[1]);
  EXPECT_EQ(view.faults, (LiveEvents{{"imu_missing", 3}}));
  EXPECT_EQ(view.limits, (LiveEvents{{"row_shed", 4}}));
}

// Where a row's work is not counted a simulation says nothing of a robot's time, whatever this machine took.
TEST(LiveView, Simulation_HostsTimeJudgesNoRow) {
  MailboxImage image = image_of_a_robot();
  image.is_virtual = true;
  image.timing.rows[0].robot = {};
  image.timing.rows[0].host = {20'000'000, 5'000'000, 0, 0};
  image.timing.rows[1].robot.least_slack_ns = 100'000;
  const LiveView view = view_of(image);
  EXPECT_TRUE(std::isnan(view.rows[0].robot.worst_us));
  EXPECT_DOUBLE_EQ(view.rows[0].host.worst_us, 5000.0);
  EXPECT_EQ(view.worst_row, 1U);
  const std::string json = json_of(view);
  EXPECT_TRUE(has(json, "\"clock\":\"simulated\"")) << json;
  EXPECT_TRUE(has(json,
                  "\"mean_us\":null,\"worst_us\":null,\"mean_slack_us\":null,\"worst_slack_us\":null,"
                  "\"host_mean_us\":20,\"host_worst_us\":5000"))
      << json;
}

TEST(LiveView, NumbersWithoutAName_AreUnknown) {
  MailboxImage image = image_of_a_robot();
  image.status.module_state = 31;
  image.status.gait_phase = 4'000'000'000U;
  const LiveView view = view_of(image);
  EXPECT_EQ(view.state, "unknown");
  EXPECT_EQ(view.phase, "unknown");
}

TEST(LiveMeter, Rate_IsOfTheLastSeconds) {
  LiveMeter meter(1.0);
  MailboxImage image = image_of_a_robot();
  image.is_virtual = true;
  LiveView view = meter.view(image, 0, 0);
  EXPECT_TRUE(std::isnan(view.cycles_per_s));
  EXPECT_FALSE(view.is_too_slow());
  for (std::int64_t i = 1; i <= 40; ++i) {  // at half the speed
    image.status.cycles += 25;
    view = meter.view(image, i * 50'000'000, i * 100'000'000);
  }
  EXPECT_NEAR(view.cycles_per_s, 250.0, 1.0);
  EXPECT_NEAR(view.speed, 0.5, 0.01);
  EXPECT_TRUE(view.is_too_slow());
  EXPECT_TRUE(has(line_of(view), "asked 1.00: this machine does not keep that pace")) << line_of(view);
  image.status.cycles = 1;
  EXPECT_TRUE(std::isnan(meter.view(image, 0, 5'000'000'000).cycles_per_s)) << "of another run nothing is known yet";
}

TEST(LiveTable, Width_IsNeverExceeded) {
  MailboxImage image = image_of_a_robot();
  for (std::size_t i = 2; i < 40; ++i) {
    put(image.names.events[i], "a_fault_of_a_name");
    image.names.event_numbers[i] = 7;
    image.events.count[i] = 4'000'000'000U;
  }
  for (const bool is_virtual : {false, true}) {
    image.is_virtual = is_virtual;
    for (const std::size_t width : {20U, 40U, 79U, 119U, 300U}) {
      const std::vector<std::string> lines = table_of(view_of(image), width);
      EXPECT_GT(lines.size(), 10U);
      for (const std::string& line : lines) {
        EXPECT_LE(line.size(), width) << line;
        EXPECT_TRUE(std::ranges::all_of(line, [](char c) { return c >= ' ' && c <= '~'; })) << line;
      }
    }
  }
}

TEST(LiveTable, WideEnough_SaysEverything) {
  std::string all;
  for (const std::string& line : table_of(view_of(image_of_a_robot()), 120)) all += line + "\n";
  for (const char* part : {"10.0 s  climbing, swing", "step 7 right onto a tread, treads climbed 3", "picture 0.100 s",
                           "map 0.200 s", "lidar pose none", "left x 1.250 y 0.000 z 0.000 m, margin 21 mm, toe free",
                           "imu_missing 3", "row_shed 4", "surfaces, slack -60 us of 840", "cycles   5000"}) {
    EXPECT_TRUE(has(all, part)) << part << " is not in\n" << all;
  }
}

TEST(LiveJson, NotKnown_IsNull) {
  const std::string json = json_of(view_of(image_of_a_robot()));
  for (const char* part : {"\"lio\":null", "\"toe_margin_m\":null", "\"right\":null", "\"cycles_per_s\":null",
                           "\"asked_speed\":null", "\"worst_row\":\"surfaces\"", "\"faults\":{\"imu_missing\":3}"}) {
    EXPECT_TRUE(has(json, part)) << part << " is not in " << json;
  }
  EXPECT_FALSE(has(json, "nan"));
  EXPECT_FALSE(has(json, "inf"));
  EXPECT_FALSE(has(json, "host_")) << "a robot has no host";
  EXPECT_FALSE(has(json, "\n"));
}

}  // namespace
}  // namespace polygmap
