// SPDX-License-Identifier: Apache-2.0
// The module's values arrive in the mailbox as they are, without a call of the heap.
#include "firmware/mailbox/mailbox_sections.hpp"

#include "sim_stub/heap_trap.hpp"
#include "tests/support/standing_module.hpp"

namespace polygmap::test {
namespace {

class MailboxSections : public StandingModule {
 protected:
  MailboxSections() { module_.pipeline().watch(watched_); }
  PerceptionTelemetry watched_;
};

TEST_F(MailboxSections, StandingRobot_PoseAndStatusAreTheModules) {
  stand(kInitialised_ticks);
  const Telemetry telemetry = module_.pipeline().telemetry(clock_.now_ns(), watched_);
  polygmap_mailbox_pose pose;
  polygmap_mailbox_status status;
  polygmap_mailbox_events events;
  {
    const heap::ModuleCall call("fill");
    fill(pose, telemetry.state);
    fill(status, control(), telemetry, 700);
    fill(events, module_.pipeline().health(), clock_.now_ns());
  }
  const StateEstimate& state = control().state();
  EXPECT_EQ(pose.stamp_ns, state.stamp_ns);
  EXPECT_EQ(pose.initialised, 1U);
  const Eigen::Quaterniond q(pose.odom_q_base[0], pose.odom_q_base[1], pose.odom_q_base[2], pose.odom_q_base[3]);
  EXPECT_LT((q.toRotationMatrix() - state.odom_T_base.R).norm(), 1e-12);
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_EQ(pose.odom_p_base_m[i], state.odom_T_base.p_m[i]);
    EXPECT_EQ(pose.odom_p_sole_m[1][i], state.odom_T_sole[1].p_m[i]);
  }
  EXPECT_EQ(pose.q_rad[11], state.q_rad[11]);
  EXPECT_EQ(status.stamp_ns, clock_.now_ns());
  EXPECT_EQ(status.cycles, 700U);
  EXPECT_EQ(status.module_state, static_cast<std::uint32_t>(control().module_state()));
  EXPECT_EQ(status.picture_stamp_ns, 0);
  EXPECT_EQ(status.map_stamp_ns, 0);
  EXPECT_EQ(status.lio_stamp_ns, 0);
  EXPECT_EQ(status.next[0].valid, 0U);
  EXPECT_TRUE(std::isnan(status.measured_tread_m));
  // As many lines as both tables have, each at its place.
  EXPECT_EQ(events.count[index_of_event(Fault::kDepthMissing)], count(Fault::kDepthMissing));
  EXPECT_GT(count(Fault::kDepthMissing), 0U) << "nothing to compare";
}

TEST_F(MailboxSections, Names_AreThoseOfTheTables) {
  polygmap_mailbox_names names;
  fill(names);
  for (std::size_t i = 0; i < kModuleStateTable.size(); ++i) {
    EXPECT_EQ(std::string_view(names.module_states[i].text), kModuleStateTable[i].name);
  }
  EXPECT_STREQ(names.module_states[kModuleStateTable.size()].text, "");
  const std::size_t limits = kFaultTable.size();
  EXPECT_EQ(std::string_view(names.events[limits].text), kLimitTable[0].name);
  EXPECT_EQ(names.event_numbers[limits], kLimitTable[0].number());
}

}  // namespace
}  // namespace polygmap::test
