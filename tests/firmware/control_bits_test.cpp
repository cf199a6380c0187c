// SPDX-License-Identifier: Apache-2.0
// One climb gives one result, bit for bit, in every output of the module: x86 with AVX2, x86 without (tests/consumer)
// and AArch64 (orin) have the same recorded here. A robot on the fakes of the ports follows the commands, so that one
// bit of difference spreads.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "firmware/schedule.hpp"
#include "tests/support/bit_hash.hpp"
#include "tests/support/fake_robot.hpp"

namespace polygmap {
namespace {

using test::BitHash;

// Numbers from a counter, the same on every target.
class CounterNoise {
 public:
  explicit CounterNoise(std::uint64_t stream) : state_(stream << 40U) {}
  [[nodiscard]] std::uint64_t bits() {  // SplitMix64
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ z >> 30U) * 0xBF58476D1CE4E5B9U;
    z = (z ^ z >> 27U) * 0x94D049BB133111EBU;
    return z ^ z >> 31U;
  }
  [[nodiscard]] double within(double most) {
    return most * (static_cast<double>(static_cast<std::int64_t>(bits() >> 11U)) * 0x1p-52 - 1.0);
  }
  template <typename Vector>
  void disturb(Vector& vector, double most) {
    for (Eigen::Index i = 0; i < vector.size(); ++i) vector[i] += within(most);
  }

 private:
  std::uint64_t state_;
};

class NoisyImu final : public hal::Imu {
 public:
  explicit NoisyImu(hal::Imu& exact) : exact_(exact) {}
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    if (!exact_.try_read(sample)) return false;
    noise_.disturb(sample.gyro_radps, 0.01);
    noise_.disturb(sample.accel_mps2, 0.1);
    return true;
  }

 private:
  hal::Imu& exact_;
  CounterNoise noise_{1};
};

class NoisyJoints final : public hal::JointBus {
 public:
  explicit NoisyJoints(hal::JointBus& exact) : exact_(exact) {}
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (!exact_.try_read(feedback)) return false;
    noise_.disturb(feedback.q_rad, 5e-5);
    noise_.disturb(feedback.dq_radps, 0.01);
    for (double& force_n : feedback.foot_force_n) force_n += noise_.within(5.0);
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override { return exact_.try_write(command); }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return exact_.status(); }

 private:
  hal::JointBus& exact_;
  CounterNoise noise_{2};
};

class NoisyLidar final : public hal::LidarOdometry {
 public:
  explicit NoisyLidar(hal::LidarOdometry& exact) : exact_(exact) {}
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    if (!exact_.try_read(sample)) return false;
    noise_.disturb(sample.lio_T_lidar.p_m, 0.003);
    return true;
  }

 private:
  hal::LidarOdometry& exact_;
  CounterNoise noise_{3};
};

class NoisyCamera final : public hal::DepthCamera {
 public:
  explicit NoisyCamera(hal::DepthCamera& exact) : exact_(exact), pixels_(kDepthWidth_px * kDepthHeight_px) {}
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return exact_.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (!exact_.try_acquire(frame)) return false;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      const std::uint64_t bits = noise_.bits();
      const std::uint16_t z = frame.depth[i];
      pixels_[i] = z < 16 || bits % 32 == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(z + (bits >> 32U) % 17 - 8);
    }
    frame.depth = pixels_.data();
    return true;
  }
  void release() noexcept override { exact_.release(); }

 private:
  hal::DepthCamera& exact_;
  std::vector<std::uint16_t> pixels_;
  CounterNoise noise_{4};
};

void add(BitHash& hash, const StateEstimate& s) {
  hash.add(static_cast<std::uint64_t>(s.stamp_ns)), hash.add(static_cast<std::uint64_t>(s.oldest_input_ns));
  hash.add(s.odom_T_base), hash.add(s.world_T_odom);
  hash.add_all(s.odom_v_base_mps), hash.add_all(s.base_w_base_radps), hash.add_all(s.q_rad);
  for (const Transform& sole : s.odom_T_sole) hash.add(sole);
  for (const double probability : s.contact_probability) hash.add(probability);
  for (const double sigma_n : s.foot_force_sigma_n) hash.add(sigma_n);
  hash.add_all(s.odom_turned_rad);
  hash.add_all(s.position_sigma_m), hash.add(s.odom_sigma_m), hash.add_all(s.velocity_sigma_mps);
  hash.add(s.yaw_sigma_rad), hash.add(s.tilt_sigma_rad);
  hash.add(static_cast<std::uint64_t>(s.lio_age_ns)), hash.add(std::uint64_t{s.initialised});
}

void add(BitHash& hash, const EstimateQuality& q) {
  hash.add_all(q.covariance), hash.add(std::uint64_t{q.outliers});
  for (const InnovationStatistics& i : q.innovations) {
    hash.add(static_cast<std::uint64_t>(i.stamp_ns)), hash.add(std::uint64_t{i.count});
    hash.add(i.last), hash.add(i.recent), hash.add(i.mean);
  }
}

void add(BitHash& hash, const Foothold& f) {
  hash.add_all(f.position_m), hash.add(f.yaw_rad), hash.add(f.clearance_m), hash.add(f.toe_clearance_m);
  hash.add(std::uint64_t{f.polygon_id}), hash.add(static_cast<std::uint64_t>(f.last_seen_ns));
  hash.add(f.nosing_distance_m);
  for (const double room_m : f.side_room_m) hash.add(room_m);
}

void add(BitHash& hash, const GaitStatus& g) {
  hash.add(static_cast<std::uint64_t>(g.phase)), hash.add(static_cast<std::uint64_t>(g.stop_reason));
  hash.add(g.stop_measured_m), hash.add(std::uint64_t{g.treads_climbed});
  for (const bool stands : g.stands) hash.add(std::uint64_t{stands});
  for (const Transform& sole : g.odom_T_sole_desired) hash.add(sole);
  hash.add_all(g.odom_p_com_desired_m);
  hash.add(std::uint64_t{g.ik_limited_ticks}), hash.add(std::uint64_t{g.early_contacts});
  hash.add(std::uint64_t{g.late_contacts}), hash.add(std::uint64_t{g.aborted_swings});
  hash.add(std::uint64_t{g.step.sequence}), hash.add(static_cast<std::uint64_t>(g.step.latch_stamp_ns));
  add(hash, g.step.target);
  hash.add(g.step.odom_T_target), hash.add(g.step.odom_T_executed);
  hash.add(static_cast<std::uint64_t>(g.step.touch_down_stamp_ns));
}

void add(BitHash& hash, const JointCommand& command) {
  for (const JointSetpoint& joint : command.joints) {
    hash.add(joint.q_rad), hash.add(joint.dq_radps), hash.add(joint.tau_ff_nm);
    hash.add(joint.kp_nmprad), hash.add(joint.kd_nmsprad);
  }
}

// What the pipeline put out since the last call is added.
struct OutputHashes {
  BitHash estimates, gait, commands, surfaces, map;
  std::int64_t surfaces_ns = 0, map_ns = 0;

  void add_outputs(const Pipeline& pipeline) {
    const ControlLane& control = pipeline.control();
    add(estimates, control.state()), add(estimates, control.estimator().quality());
    add(gait, control.gait_status());
    add(commands, control.last_command());
    if (const SurfaceFrame& frame = pipeline.perception().surface_frame(); frame.stamp_ns != surfaces_ns) {
      surfaces_ns = frame.stamp_ns;
      for (const SurfacePatch& patch : frame.surfaces) surfaces.add(patch);
    }
    if (const MapSnapshot& snapshot = pipeline.perception().map_snapshot(); snapshot.stamp_ns != map_ns) {
      map_ns = snapshot.stamp_ns;
      map.add_all(snapshot.drift_m);
      for (const MapPolygon& polygon : snapshot.polygons) {
        map.add(polygon.surface), map.add(std::uint64_t{polygon.id}), map.add(std::uint64_t{polygon.sightings});
      }
    }
  }
};

TEST(ControlBits, ClimbOfNoisyInputs_GivesTheRecordedBits) {
  constexpr int kTicks = 6000;
  test::FakeRobot robot(0.062);
  robot.picture_ticks = 48;
  NoisyImu imu(robot.imu);
  NoisyJoints joints(robot.joints);
  NoisyLidar lidar(robot.lidar);
  NoisyCamera camera(robot.camera);
  const auto pipeline = std::make_unique<Pipeline>(Ports{camera, imu, joints, lidar}, Params{});
  OneLaneExecutive<> executive(*pipeline, robot.clock, pipeline->lane_health(0));
  executive.start(robot.clock.now_ns() + kCycle_ns);
  OutputHashes hashes;
  for (int i = 0; i < kTicks; ++i) {
    robot.advance();
    executive.tick(robot.clock.now_ns());
    hashes.add_outputs(*pipeline);
  }
  // Estimate, map, footholds, plan and swings all took part.
  EXPECT_GE(pipeline->control().gait_status().treads_climbed, 1U);
  // Recorded anew when a result changes on purpose, and then the same in presets release and orin.
  EXPECT_EQ(hashes.estimates.value(), 10144323502626447275U);
  EXPECT_EQ(hashes.gait.value(), 11538538321726745745U);
  EXPECT_EQ(hashes.commands.value(), 10505122840810925701U);
  EXPECT_EQ(hashes.surfaces.value(), 8165427209321628568U);
  EXPECT_EQ(hashes.map.value(), 17611560947983038124U);
}

}  // namespace
}  // namespace polygmap
