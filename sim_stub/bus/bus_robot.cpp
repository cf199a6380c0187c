// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/bus/bus_robot.hpp"

#include <algorithm>

#include "sim_stub/sensors/virtual_clock.hpp"

namespace polygmap::sim {
namespace {

constexpr std::int64_t kReply_ns = 20'000;       // a drive's processor takes so long
constexpr std::int64_t kFeetPhase_ns = 100'000;  // the feet's board speaks so long after a tick
constexpr std::uint8_t kEnabledNibble = 1, kErrorCode = 9;

std::vector<std::unique_ptr<SimCanBus>> make_buses(const config::BusFile& file) {
  std::vector<std::unique_ptr<SimCanBus>> buses;
  for (std::size_t i = 0; i < file.table.bus_count; ++i) {
    buses.push_back(std::make_unique<SimCanBus>(file.table.bitrate_bps));
  }
  return buses;
}

std::vector<hal::CanChannel*> channels_of(const std::vector<std::unique_ptr<SimCanBus>>& buses) {
  std::vector<hal::CanChannel*> channels;
  for (const auto& bus : buses) channels.push_back(bus.get());
  return channels;
}

bool in_error(DriveFault fault) noexcept { return fault == DriveFault::kError || fault == DriveFault::kLatched; }

template <std::size_t N>
hal::CanFrame frame_of(std::uint32_t id, const std::array<std::uint8_t, N>& bytes) {
  hal::CanFrame frame;
  frame.id = id;
  frame.length = N;
  std::ranges::copy(bytes, frame.data.begin());
  return frame;
}

}  // namespace

BusRobot::BusRobot(SimRobot& robot, const config::BusFile& bus, CandumpLog* log)
    : robot_(robot),
      file_(bus),
      log_(log),
      buses_(make_buses(bus)),
      channels_(channels_of(buses_)),
      joints_(bus.table, channels_) {
  (void)robot_.try_read(feedback_);
}

void BusRobot::set_fault(std::size_t joint, DriveFault fault) noexcept {
  Drive& drive = drives_[joint];
  if (drive.fault == DriveFault::kDead && fault != DriveFault::kDead) {
    drive.enabled = false;
    drive.command = {};
  }
  drive.fault = fault;
}

void BusRobot::advance() {
  const std::int64_t now_ns = robot_.now_ns();
  if (file_.table.feet.present && !feet_silent_) send_feet(now_ns);
  for (std::size_t i = 0; i < buses_.size(); ++i) {
    buses_[i]->run(
        now_ns, now_ns + VirtualClock::kTick_ns,
        [this, i](const hal::CanFrame& frame, std::int64_t done_ns) { receive(i, frame, done_ns); },
        [this, i](const hal::CanFrame& frame) {
          if (log_ != nullptr) log_->write(frame, file_.buses[i]);
        });
  }
  command_robot(now_ns);
  robot_.advance();
  (void)robot_.try_read(feedback_);
}

void BusRobot::send_feet(std::int64_t now_ns) {
  const hal::CanFeet& feet = file_.table.feet;
  buses_[feet.bus]->send(frame_of(feet.id, hal::feet_frame(feedback_.foot_force_n, feet.unit_n)),
                         now_ns + kFeetPhase_ns);
}

void BusRobot::receive(std::size_t bus, const hal::CanFrame& frame, std::int64_t done_ns) {
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const hal::CanDrive& description = file_.table.drives[n];
    if (description.bus != bus || description.id != frame.id || frame.length != 8) continue;
    Drive& drive = drives_[n];
    if (drive.fault == DriveFault::kUnplugged || drive.fault == DriveFault::kDead) return;
    hal::MitBytes bytes{};
    std::copy_n(frame.data.begin(), bytes.size(), bytes.begin());
    JointSetpoint command;
    if (drive.fault == DriveFault::kLatched) {  // it takes nothing else
      const bool has_frame = description.reply == hal::MitReplyRule::kStatusNibble;
      if (has_frame && bytes == hal::special_frame(hal::MitSpecial::kClearErrors)) {
        drive.fault = DriveFault::kNone;
        drive.enabled = drive.commanded = false;
        drive.command = {};
      }
    } else if (bytes == hal::special_frame(hal::MitSpecial::kEnter)) {
      drive.enabled = true;
    } else if (bytes == hal::special_frame(hal::MitSpecial::kExit)) {
      drive.enabled = false;
      drive.command = {};
    } else if (hal::try_decode_command(bytes, description.ranges, command) && drive.enabled) {
      drive.command = command;
      drive.commanded = true;
    }
    reply(n, done_ns);
    return;
  }
}

void BusRobot::reply(std::size_t joint, std::int64_t done_ns) {
  const hal::CanDrive& description = file_.table.drives[joint];
  const Drive& drive = drives_[joint];
  const auto i = static_cast<Eigen::Index>(joint);
  hal::MitReply reply;
  reply.p_rad = feedback_.q_rad[i];
  reply.v_radps = feedback_.dq_radps[i];
  reply.t_nm = feedback_.tau_nm[i];
  reply.motor_degc = reply.mos_degc = drive.degc;
  if (in_error(drive.fault)) {
    reply.status = kErrorCode;
  } else if (description.reply == hal::MitReplyRule::kStatusNibble && drive.enabled) {
    reply.status = kEnabledNibble;
  }
  buses_[description.bus]->send(
      frame_of(description.reply_id, hal::reply_frame(reply, description.id, description.ranges, description.reply)),
      done_ns + kReply_ns);
}

void BusRobot::hold_again() {
  held_again_ = true;
  robot_.hold_again();
}

void BusRobot::command_robot(std::int64_t now_ns) {
  if (held_again_) return;
  JointCommand command;
  command.stamp_ns = now_ns;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const Drive& drive = drives_[n];
    const bool starts = drive.fault == DriveFault::kNone || drive.fault == DriveFault::kLatched;
    if (!drive.commanded && starts) return;
    const bool limp = drive.fault == DriveFault::kDead || in_error(drive.fault);
    if (!limp) command.joints[n] = drive.command;
  }
  (void)robot_.try_write(command);
}

}  // namespace polygmap::sim
