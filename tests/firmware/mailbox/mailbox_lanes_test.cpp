// SPDX-License-Identifier: Apache-2.0
// Control and perception on threads of their own, and a third that reads: what the mailbox has of both is whole.
#include <atomic>
#include <barrier>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "firmware/mailbox/mailbox_feed.hpp"
#include "sim_stub/heap_trap.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/firmware/mailbox/mailbox_fixture.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::test {
namespace {

class MailboxOfTwoLanes : public MailboxFixture {
 protected:
  MailboxOfTwoLanes() : camera_(robot_camera_intrinsics()) {
    pipeline_ = std::make_unique<Pipeline>(Ports{camera_, imu_, joints_, lidar_}, Params{});
    pipeline_->watch(*watched_);
    control_.emplace(*pipeline_, control_clock_, pipeline_->lane_health(kControlLane));
    perception_.emplace(*pipeline_, perception_clock_, pipeline_->lane_health(kPerceptionLane));
    control_->start(control_clock_.now_ns() + kCycle_ns);
    perception_->start(perception_clock_.now_ns() + kCycle_ns);
  }
  void control_frame(MailboxFeed& feed) {
    control_clock_.advance_ns(kCycle_ns);
    const std::int64_t now_ns = control_clock_.now_ns();
    imu_.feed({now_ns, Vec3::Zero(), Vec3{0, 0, kGravity_mps2}});
    JointFeedback feedback;
    feedback.stamp_ns = now_ns;
    feedback.q_rad = standing_joints();
    feedback.foot_force_n = {270.0, 270.0};
    joints_.feed(feedback);
    const heap::ModuleCall call("control lane");
    control_->tick(now_ns);
    (void)feed.after_cycle(pipeline_->control(), pipeline_->telemetry(now_ns, *watched_));
  }
  void perception_frame() {
    perception_clock_.advance_ns(kCycle_ns);
    const heap::ModuleCall call("perception lane");
    perception_->tick(perception_clock_.now_ns());
  }

  fakes::FakeClock control_clock_ = three_days_up(), perception_clock_ = three_days_up();
  fakes::FakeDepthCamera camera_;
  fakes::FakeImu imu_;
  fakes::FakeJointBus joints_;
  fakes::FakeLidarOdometry lidar_;
  const std::unique_ptr<PerceptionTelemetry> watched_ = std::make_unique<PerceptionTelemetry>();
  std::unique_ptr<Pipeline> pipeline_;
  std::optional<LaneExecutive<kControlLane>> control_;
  std::optional<LaneExecutive<kPerceptionLane>> perception_;
};

TEST_F(MailboxOfTwoLanes, StandingBeforeStairs_PolygonsAndFootholdsArriveWhole) {
  constexpr int kFrames = 1100, kFirstPicture = 700;
  DepthScene scene;
  scene.world_T_camera = Transform{Mat3::Identity(), Vec3{0, 0, kNominalBaseHeight_m}} * base_T_camera();
  scene.add_stairs({.rise_m = 0.13, .first_riser_x_m = kCollisionRectangle.toe_x_m + 0.1});
  const std::vector<std::uint16_t> stairs = render_for_robot(scene);
  MailboxWriter writer;
  ASSERT_EQ(writer.open(config_), "");
  ASSERT_EQ(attach(), POLYGMAP_MAILBOX_OK) << why_;
  const auto feed = std::make_unique<MailboxFeed>(writer);
  std::atomic<bool> ends{false};
  int wrong = 0, plans = 0;
  std::thread reads([&] {
    const auto plan = std::make_unique<polygmap_plan>();
    while (!ends) {
      std::this_thread::yield();
      if (!polygmap_mailbox_try_copy(&reader_.box->plan_lock, &reader_.box->plan, plan.get(), sizeof *plan)) continue;
      ++plans;
      const bool counts_fit = plan->polygon_count <= POLYGMAP_MAX_POLYGONS && plan->body_count <= POLYGMAP_BODY_SAMPLES;
      wrong += counts_fit ? 0 : 1;
      for (std::uint32_t i = 0; counts_fit && i < plan->polygon_count; ++i) {
        const polygmap_polygon& polygon = plan->polygon[i];
        const double length = std::hypot(polygon.normal[0], polygon.normal[1], polygon.normal[2]);
        wrong += polygon.vertices >= 3 && std::abs(length - 1.0) < 1e-6 && polygon.last_seen_ns > 0 ? 0 : 1;
      }
    }
  });
  std::barrier frame_begins(2);  // both lanes run the same frame at the same time
  std::thread control([&] {
    for (int i = 0; i < kFrames; ++i) {
      frame_begins.arrive_and_wait();
      control_frame(*feed);
    }
  });
  for (int i = 0; i < kFrames; ++i) {
    frame_begins.arrive_and_wait();
    if (i > kFirstPicture && i % 16 == 0) camera_.feed(perception_clock_.now_ns(), stairs);
    perception_frame();
  }
  control.join();
  ends = true;
  reads.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(plans, 10);
  const polygmap_mailbox& box = *reader_.box;
  EXPECT_EQ(box.status.cycles, static_cast<std::uint64_t>(kFrames));
  EXPECT_GT(box.status.picture_stamp_ns, 0);
  EXPECT_EQ(box.status.map_stamp_ns, box.plan.map_stamp_ns);
  EXPECT_EQ(box.plan.polygon_count, watched_->map.front().polygons.size());
  EXPECT_GT(box.plan.polygon_count, 2U);
  EXPECT_EQ(box.status.next[0].valid, 1U);
  EXPECT_GT(box.status.next[0].odom_p_sole_m[0], 0.2);
}

}  // namespace
}  // namespace polygmap::test
