// SPDX-License-Identifier: Apache-2.0
// The simulated robot behind CAN buses: MIT drives that decode commands and reply, and the feet's sensor board. The
// module's side is the joint bus of a robot.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "firmware/config/bus_file.hpp"
#include "hal/can/can_joint_bus.hpp"
#include "sim_stub/bus/candump_log.hpp"
#include "sim_stub/bus/sim_can_bus.hpp"
#include "sim_stub/sim_robot.hpp"

namespace polygmap::sim {

// What is wrong with a drive; for tests and experiments.
enum class DriveFault : std::uint8_t {
  kNone,
  kUnplugged,  // hears and says nothing, and holds what it was told last
  kDead,       // says nothing and gives no torque; afterwards it has restarted, and is out of motor mode
  kError,      // tells of an error and gives no torque
  kLatched,    // the same, until it hears the frame that clears errors: then it is out of motor mode, without fault
};

// A command moves its drive one cycle after it was written, as without a bus, and the reply to it, with the joint as it
// was when the cycle began, is read one cycle after it was written, which is one later than without. Until every drive
// has had a command in motor mode the robot is held up by what holds SimRobot before its first command.
class BusRobot {
 public:
  // robot outlives this; log may be null.
  BusRobot(SimRobot& robot, const config::BusFile& bus, CandumpLog* log);
  BusRobot(const BusRobot&) = delete;
  BusRobot& operator=(const BusRobot&) = delete;

  [[nodiscard]] hal::CanJointBus& joints() noexcept { return joints_; }
  [[nodiscard]] SimCanBus& bus(std::size_t i) noexcept { return *buses_[i]; }
  void set_fault(std::size_t joint, DriveFault fault) noexcept;
  // What it tells of itself from now on, motor and transistors alike.
  void set_temperature(std::size_t joint, std::int16_t degc) noexcept { drives_[joint].degc = degc; }
  void set_feet_silent(bool silent) noexcept { feet_silent_ = silent; }
  // As SimRobot's; the drives' commands count no more.
  void hold_again();
  // Instead of the robot's: the buses run for a tick, then the robot does.
  void advance();

 private:
  struct Drive {
    DriveFault fault = DriveFault::kNone;
    bool enabled = false;
    bool commanded = false;
    std::int16_t degc = 40;
    JointSetpoint command;
  };
  void send_feet(std::int64_t now_ns);
  void receive(std::size_t bus, const hal::CanFrame& frame, std::int64_t done_ns);
  void reply(std::size_t joint, std::int64_t done_ns);
  void command_robot(std::int64_t now_ns);

  SimRobot& robot_;
  config::BusFile file_;
  CandumpLog* log_;
  std::vector<std::unique_ptr<SimCanBus>> buses_;
  std::vector<hal::CanChannel*> channels_;
  hal::CanJointBus joints_;
  std::array<Drive, kJointCount> drives_;
  bool feet_silent_ = false;
  bool held_again_ = false;
  JointFeedback feedback_;  // as the tick begins
};

}  // namespace polygmap::sim
