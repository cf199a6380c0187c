// SPDX-License-Identifier: Apache-2.0
#include "hal/can/can_joint_bus.hpp"

#include <algorithm>
#include <limits>

namespace polygmap::hal {
namespace {

constexpr void count(std::uint32_t& counter, std::uint32_t times = 1) noexcept {
  const std::uint32_t room = std::numeric_limits<std::uint32_t>::max() - counter;
  counter += std::min(times, room);
}

constexpr JointSet without(JointSet set, std::size_t joint) noexcept {
  return JointSet::of_bits(set.bits() & ~(1U << joint));
}

}  // namespace

CanJointBus::CanJointBus(const DriveTable& table, std::span<CanChannel* const> channels) noexcept : table_(table) {
  for (std::size_t bus = 0; bus < buses_.size(); ++bus) {
    if (bus < channels.size()) buses_[bus].channel = channels[bus];
    for (std::size_t n = 0; n < kJointCount; ++n) {
      if (table.drives[n].bus == bus) (void)buses_[bus].joints.try_push_back(static_cast<std::uint8_t>(n));
    }
  }
  feedback_.silent_cycles.fill(JointFeedback::kNeverHeard);
  feedback_.foot_force_n.fill(std::numeric_limits<double>::quiet_NaN());
  status_.senses_feet = table.feet.present;
}

bool CanJointBus::try_read(JointFeedback& feedback) noexcept {
  replied_ = {};
  for (std::size_t bus = 0; bus < kMaxBuses; ++bus) {
    if (buses_[bus].channel == nullptr) continue;
    for (std::size_t taken = 0; taken < kMaxFramesPerRead;) {
      const std::size_t came = buses_[bus].channel->read(read_frames_);
      for (std::size_t i = 0; i < came; ++i) take(bus, read_frames_[i]);
      taken += came;
      if (came < read_frames_.size()) break;
    }
  }
  count_bus_offs();
  note_feet_silent();
  if (replied_.is_empty()) return false;
  feedback_.stamp_ns = command_ns_;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (!heard_.contains(n)) continue;
    const std::int64_t cycles = (command_ns_ - replied_ns_[n]) / kBusCycle_ns;
    feedback_.silent_cycles[n] =
        static_cast<std::uint16_t>(std::clamp<std::int64_t>(cycles, 0, JointFeedback::kNeverHeard - 1));
  }
  feedback = feedback_;
  return true;
}

void CanJointBus::note_feet_silent() noexcept {
  if (!table_.feet.present || command_ns_ < 0) return;
  status_.feet_silent = feet_ns_ < 0 || command_ns_ - feet_ns_ > kSilent_ns;
  if (status_.feet_silent) feedback_.foot_force_n.fill(std::numeric_limits<double>::quiet_NaN());
}

void CanJointBus::take(std::size_t bus, const CanFrame& frame) noexcept {
  // What came before the first command answers nobody; of errors the channel keeps count.
  if (frame.error || command_ns_ < 0) return;
  const std::span<const std::uint8_t> bytes(frame.data.data(), std::min<std::size_t>(frame.length, 8));
  if (frame.extended || frame.id > kMaxCanId) return count(status_.unknown_ids);
  bool known = false;
  const bool stale = frame.stamp_ns != 0 && command_ns_ - frame.stamp_ns > kStale_ns;
  if (table_.feet.present && bus == table_.feet.bus && frame.id == table_.feet.id) {
    return stale ? count(status_.stale) : take_feet(frame);
  }
  for (const std::size_t n : buses_[bus].joints) {
    const CanDrive& drive = table_.drives[n];
    if (frame.id != drive.reply_id) continue;
    known = true;
    if (bytes.empty() || name_in_reply(bytes, drive.reply) != reply_name(drive.id, drive.reply)) continue;
    return stale ? count(status_.stale) : take_reply(n, frame);
  }
  count(known ? status_.bad_frames : status_.unknown_ids);
}

void CanJointBus::take_feet(const CanFrame& frame) noexcept {
  const std::span<const std::uint8_t> bytes(frame.data.data(), std::min<std::size_t>(frame.length, frame.data.size()));
  if (frame.fd || !try_decode_feet(bytes, table_.feet.unit_n, feedback_.foot_force_n)) return count(status_.bad_frames);
  feet_ns_ = command_ns_;
}

void CanJointBus::take_reply(std::size_t joint, const CanFrame& frame) noexcept {
  const CanDrive& drive = table_.drives[joint];
  const std::span<const std::uint8_t> bytes(frame.data.data(), std::min<std::size_t>(frame.length, frame.data.size()));
  MitReply reply;
  if (frame.fd || !try_decode_reply(bytes, drive.id, drive.ranges, drive.reply, reply)) {
    return count(status_.bad_frames);
  }
  if (!reply.enabled && !heard_.contains(joint)) return;  // it is sent the frame that enters motor mode again
  if (lapsed_.contains(joint) && !try_take_back(joint, reply)) return;
  const bool error = reply.error || !reply.enabled;
  JointSet errors = without(status_.drive_errors, joint);
  if (error) {
    errors.insert(joint);
    count(status_.drive_error_replies);
  }
  status_.drive_errors = errors;
  status_.drive_code[joint] = error ? reply.status : std::uint8_t{0};
  status_.drive_degc[joint] = reply.hottest_degc();

  const auto i = static_cast<Eigen::Index>(joint);
  feedback_.q_rad[i] = reply.p_rad;
  feedback_.dq_radps[i] = reply.v_radps;
  feedback_.tau_nm[i] = reply.t_nm;
  replied_ns_[joint] = command_ns_;
  heard_.insert(joint);
  replied_.insert(joint);
}

bool CanJointBus::try_take_back(std::size_t joint, const MitReply& reply) noexcept {
  returned_.insert(joint);
  if (!reply.enabled) {  // no error of a drive that is about to be entered
    status_.drive_errors = without(status_.drive_errors, joint);
    status_.drive_code[joint] = 0;
    return false;
  }
  if (entered_.contains(joint) && !reply.error) {
    lapsed_ = without(lapsed_, joint);
  }
  return true;
}

void CanJointBus::note_lapsed() noexcept {
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (heard_.contains(n) && command_ns_ - replied_ns_[n] > kSilent_ns) lapsed_.insert(n);
  }
}

void CanJointBus::note_error(std::size_t joint, const JointSetpoint& command) noexcept {
  const bool asks_nothing = command.kp_nmprad == 0.0 && command.kd_nmsprad == 0.0 && command.tau_ff_nm == 0.0;
  if (asks_nothing && status_.drive_errors.contains(joint)) lapsed_.insert(joint);
}

std::optional<MitSpecial> CanJointBus::special_due(std::size_t joint, std::uint32_t write) const noexcept {
  if (write % 2 != 0) return std::nullopt;
  if (!heard_.contains(joint)) return MitSpecial::kEnter;
  if (!lapsed_.contains(joint)) return std::nullopt;
  const bool in_error = status_.drive_errors.contains(joint);
  const bool at_once = returned_.contains(joint) && !in_error;  // an error may stay, whatever is sent
  if (!at_once && write % kEnterPeriod != 0) return std::nullopt;
  const bool can_clear = table_.drives[joint].reply == MitReplyRule::kStatusNibble;
  return in_error && can_clear ? MitSpecial::kClearErrors : MitSpecial::kEnter;
}

JointSet CanJointBus::try_write(const JointCommand& command) noexcept {
  note_lapsed();
  command_ns_ = command.stamp_ns;
  const std::uint32_t write = writes_++;
  JointFrames frames{};
  JointSet made, entered;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (!try_encode_command(command.joints[n], table_.drives[n].ranges, frames[n], status_.clamped)) {
      count(status_.not_finite);
      continue;
    }
    note_error(n, command.joints[n]);
    const std::optional<MitSpecial> special = special_due(n, write);
    if (special) frames[n] = special_frame(*special);
    if (special == MitSpecial::kEnter) entered.insert(n);
    made.insert(n);
  }
  returned_ = {};
  const JointSet taken = send(frames, made);
  entered_ = JointSet::of_bits(entered.bits() & taken.bits());
  return taken;
}

JointSet CanJointBus::send(const JointFrames& frames, JointSet joints) noexcept {
  JointSet taken;
  for (const Bus& bus : buses_) {
    StaticVector<std::uint8_t, kJointCount> queued;
    for (const std::uint8_t n : bus.joints) {
      if (!joints.contains(n)) continue;
      CanFrame& frame = queue_[queued.size()];
      frame.id = table_.drives[n].id;
      frame.length = static_cast<std::uint8_t>(frames[n].size());
      std::ranges::copy(frames[n], frame.data.begin());
      (void)queued.try_push_back(n);
    }
    if (queued.empty()) continue;
    const std::size_t sent =
        bus.channel == nullptr ? 0 : std::min(bus.channel->write({queue_.data(), queued.size()}), queued.size());
    for (std::size_t i = 0; i < sent; ++i) taken.insert(queued[i]);
    count(status_.refused, static_cast<std::uint32_t>(queued.size() - sent));
  }
  count_bus_offs();
  return taken;
}

void CanJointBus::count_bus_offs() noexcept {
  status_.bus_off = false;
  status_.lost = status_.failed_calls = 0;
  for (Bus& bus : buses_) {
    if (bus.channel == nullptr) continue;
    const CanChannelStatus channel = bus.channel->status();
    if (channel.bus_off && !bus.was_off) count(status_.bus_offs);
    bus.was_off = channel.bus_off;
    status_.bus_off |= channel.bus_off;
    count(status_.lost, channel.lost);
    count(status_.failed_calls, channel.failed_calls);
  }
}

JointBusStatus CanJointBus::status() const noexcept { return status_; }

}  // namespace polygmap::hal
