// SPDX-License-Identifier: Apache-2.0
// The joint bus among frames that nobody should send: whatever comes, its readings lie within the drives' ranges, every
// frame is taken or counted, and what it sends a drive can read.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "hal/can/can_joint_bus.hpp"
#include "tests/support/for_a_minute.hpp"

namespace polygmap::hal {
namespace can_fuzz_test {
namespace {

// Holds what it is given for one read.
class OneReadChannel final : public CanChannel {
 public:
  std::size_t read(std::span<CanFrame> frames) noexcept override {
    const std::size_t n = std::min(frames.size(), incoming.size());
    std::copy_n(incoming.end() - static_cast<std::ptrdiff_t>(n), n, frames.begin());
    incoming.resize(incoming.size() - n);
    return n;
  }
  std::size_t write(std::span<const CanFrame> frames) noexcept override {
    const std::size_t taken = std::min(frames.size(), room);
    sent.assign(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(taken));
    return taken;
  }
  CanChannelStatus status() const noexcept override { return {}; }

  std::vector<CanFrame> incoming, sent;
  std::size_t room = kJointCount;
};

class Fuzzer {
 public:
  explicit Fuzzer(unsigned seed) : random_(seed) { start(); }

  void run(int runs) {
    for (int run = 0; run < runs && !testing::Test::HasFatalFailure(); ++run) {
      if (run % 1000 == 0) start();
      command();
      receive();
    }
  }
  [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
  [[nodiscard]] std::uint64_t counted() const { return counted_; }

 private:
  static constexpr std::size_t kBuses = 4;

  // Another robot, with ranges and a dialect of its own.
  void start() {
    table_ = {};
    const MitReplyRule rule = chance(2) ? MitReplyRule::kId : MitReplyRule::kStatusNibble;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const MitRanges ranges{between(0.1, 20.0), between(0.1, 80.0), between(0.1, 400.0), between(0.1, 5000.0),
                             between(0.001, 100.0)};
      table_.drives[n] = {static_cast<std::uint8_t>(n / 3), static_cast<std::uint16_t>(n + 1),
                          static_cast<std::uint16_t>(rule == MitReplyRule::kId ? 0 : 0x11 + n), rule, ranges};
    }
    table_.feet = {chance(4), 0, 0x60, between(1e-4, 100.0)};
    table_.bus_count = kBuses;
    channels_ = {};
    std::array<CanChannel*, kBuses> pointers{};
    for (std::size_t bus = 0; bus < kBuses; ++bus) pointers[bus] = &channels_[bus];
    bus_.emplace(table_, pointers);
  }
  [[nodiscard]] bool chance(unsigned one_not_in) { return random_() % one_not_in != 0; }
  [[nodiscard]] double between(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  [[nodiscard]] double any_number() {
    constexpr std::array kOdd{std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity(),
                              1e300,
                              -1e300,
                              5e-324,
                              -0.0};
    const std::uint64_t odd = random_() % 32;
    return odd < kOdd.size() ? kOdd[odd] : between(-30.0, 30.0);
  }

  void command() {
    JointCommand command;
    command.stamp_ns = now_ns_ += kBusCycle_ns;
    for (JointSetpoint& joint : command.joints) {
      joint = {any_number(), any_number(), any_number(), std::abs(any_number()), std::abs(any_number())};
    }
    for (OneReadChannel& channel : channels_) {
      channel.sent.clear();
      channel.room = chance(16) ? kJointCount : random_() % kJointCount;
    }
    const JointSet taken = bus_->try_write(command);
    std::size_t sent = 0;
    for (std::size_t bus = 0; bus < kBuses; ++bus) {
      for (const CanFrame& frame : channels_[bus].sent) expect_readable(bus, frame);
      sent += channels_[bus].sent.size();
    }
    ASSERT_EQ(sent, static_cast<std::size_t>(std::popcount(taken.bits())));
  }
  // By the drive that it goes to: as a frame of special meaning, or with every value within that drive's ranges.
  void expect_readable(std::size_t bus, const CanFrame& frame) {
    ASSERT_TRUE(!frame.extended && !frame.fd && !frame.error && frame.length == 8);
    ASSERT_TRUE(frame.id >= 1 && frame.id <= kJointCount && table_.drives[frame.id - 1].bus == bus) << frame.id;
    const MitRanges& ranges = table_.drives[frame.id - 1].ranges;
    MitBytes bytes{};
    std::copy_n(frame.data.begin(), bytes.size(), bytes.begin());
    JointSetpoint read;
    if (!try_decode_command(bytes, ranges, read)) return;
    ASSERT_LE(std::abs(read.q_rad), ranges.p_rad);
    ASSERT_LE(std::abs(read.dq_radps), ranges.v_radps);
    ASSERT_LE(std::abs(read.tau_ff_nm), ranges.t_nm);
    ASSERT_TRUE(read.kp_nmprad >= 0.0 && read.kp_nmprad <= ranges.kp_nmprad);
    ASSERT_TRUE(read.kd_nmsprad >= 0.0 && read.kd_nmsprad <= ranges.kd_nmsprad);
  }

  // A drive's reply or the feet's frame, and then something else about it.
  [[nodiscard]] CanFrame any_frame(std::size_t bus) {
    CanFrame frame;
    const CanDrive& drive = table_.drives[chance(12) ? 3 * bus + random_() % 3 : random_() % kJointCount];
    frame.id = chance(5) ? drive.reply_id : table_.feet.id;
    frame.length = frame.id == table_.feet.id ? 4 : 8;
    for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random_());
    frame.data[0] = static_cast<std::uint8_t>(drive.id | (random_() % 4 == 0 ? random_() << 4U : 0x10U));
    if (drive.reply == MitReplyRule::kId) frame.data[0] = static_cast<std::uint8_t>(drive.id);
    if (chance(3)) frame.data[7] = 0;
    switch (random_() % 12) {
      case 0:
        frame.length = static_cast<std::uint8_t>(random_());
        break;
      case 1:
        frame.id = static_cast<std::uint32_t>(random_());
        break;
      case 2:
        frame.extended = true;
        break;
      case 3:
        frame.fd = true;
        break;
      case 4:
        frame.error = true;
        break;
      case 5:
        frame.stamp_ns = static_cast<std::int64_t>(random_() >> 1U);
        break;
      case 6:
        frame.stamp_ns = now_ns_ - static_cast<std::int64_t>(random_() % 20'000'000);
        break;
      case 7:
        frame.data[0] = static_cast<std::uint8_t>(random_());
        break;
      default:
        break;
    }
    return frame;
  }

  void receive() {
    const JointBusStatus before = bus_->status();
    std::uint32_t came = 0;
    for (std::size_t bus = 0; bus < kBuses; ++bus) {
      OneReadChannel& channel = channels_[bus];
      for (std::uint64_t n = random_() % 5; n > 0; --n) channel.incoming.push_back(any_frame(bus));
      for (const CanFrame& frame : channel.incoming) came += frame.error ? 0U : 1U;
    }
    JointFeedback feedback;
    const bool any = bus_->try_read(feedback);
    const JointBusStatus after = bus_->status();
    const std::uint32_t refused =
        after.bad_frames - before.bad_frames + after.unknown_ids - before.unknown_ids + after.stale - before.stale;
    ASSERT_LE(refused, came);
    if (any) {
      ASSERT_LT(refused, came) << "a reading of frames that were all refused";
      accepted_ += came - refused;
      expect_within_ranges(feedback);
    }
    counted_ += refused;
  }
  void expect_within_ranges(const JointFeedback& feedback) {
    ASSERT_EQ(feedback.stamp_ns, now_ns_);
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const auto i = static_cast<Eigen::Index>(n);
      const MitRanges& ranges = table_.drives[n].ranges;
      ASSERT_LE(std::abs(feedback.q_rad[i]), ranges.p_rad) << n;
      ASSERT_LE(std::abs(feedback.dq_radps[i]), ranges.v_radps) << n;
      ASSERT_LE(std::abs(feedback.tau_nm[i]), ranges.t_nm) << n;
    }
    for (const double force_n : feedback.foot_force_n) {
      ASSERT_TRUE(std::isnan(force_n) || (force_n >= 0.0 && force_n <= 65535.0 * table_.feet.unit_n)) << force_n;
    }
  }

  std::mt19937_64 random_;
  DriveTable table_;
  std::array<OneReadChannel, kBuses> channels_;
  std::optional<CanJointBus> bus_;
  std::int64_t now_ns_ = 1'000'000'000;
  std::uint64_t accepted_ = 0, counted_ = 0;
};

void fuzz_bus(int runs, unsigned seed) {
  Fuzzer fuzzer(seed);
  fuzzer.run(runs);
  // Neither all refused nor all taken: it tried both.
  EXPECT_GT(fuzzer.accepted(), static_cast<std::uint64_t>(runs));
  EXPECT_GT(fuzzer.counted(), static_cast<std::uint64_t>(runs));
}
TEST(CanJointBus, AnyFrames_GiveReadingsWithinRangesOrAreCounted) { fuzz_bus(20'000, 1); }
TEST(LongFuzzCanJointBus, AnyFrames_GiveReadingsWithinRangesOrAreCounted) {
  test::for_a_minute(2, [](unsigned seed) { fuzz_bus(1'000'000, seed); });
}

// The codec alone, in memory of exactly the frame's size.
void fuzz_codec(int runs, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uint64_t decoded = 0, feet_decoded = 0;
  for (int run = 0; run < runs; ++run) {
    const MitRanges ranges{0.1 + 1e-3 * static_cast<double>(random() % 30'000), 25.0, 200.0, 500.0, 5.0};
    std::vector<std::uint8_t> bytes(random() % 3 == 0 ? random() % 65 : 4 + 2 * (random() % 3));
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const auto id = static_cast<std::uint32_t>(1 + random() % 15);
    const MitReplyRule rule = random() % 2 == 0 ? MitReplyRule::kId : MitReplyRule::kStatusNibble;
    if (!bytes.empty() && random() % 4 != 0) bytes[0] = static_cast<std::uint8_t>(id);
    MitReply reply;
    if (try_decode_reply(bytes, id, ranges, rule, reply)) {
      ++decoded;
      ASSERT_TRUE(std::abs(reply.p_rad) <= ranges.p_rad && std::abs(reply.v_radps) <= ranges.v_radps &&
                  std::abs(reply.t_nm) <= ranges.t_nm);
      MitReply again;  // what was read is sent as it was
      ASSERT_TRUE(try_decode_reply(reply_frame(reply, id, ranges, rule), id, ranges, rule, again));
      ASSERT_TRUE(again.p_rad == reply.p_rad && again.v_radps == reply.v_radps && again.t_nm == reply.t_nm);
      ASSERT_EQ(again.status, reply.status);
    }
    std::array<double, kFootCount> force_n{-1.0, -1.0};
    if (!try_decode_feet(bytes, 0.5, force_n)) continue;
    ++feet_decoded;
    const auto frame = feet_frame(force_n, 0.5);
    ASSERT_TRUE(std::equal(frame.begin(), frame.end(), bytes.begin(), bytes.end()));
  }
  EXPECT_GT(decoded, static_cast<std::uint64_t>(runs) / 5);
  EXPECT_GT(feet_decoded, static_cast<std::uint64_t>(runs) / 10);
}
TEST(MitCodec, AnyBytes_GiveValuesWithinRangesOrARefusal) { fuzz_codec(50'000, 3); }
TEST(LongFuzzMitCodec, AnyBytes_GiveValuesWithinRangesOrARefusal) {
  test::for_a_minute(4, [](unsigned seed) { fuzz_codec(1'000'000, seed); });
}

}  // namespace
}  // namespace can_fuzz_test
}  // namespace polygmap::hal
