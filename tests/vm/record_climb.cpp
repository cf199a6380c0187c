// SPDX-License-Identifier: Apache-2.0
// record_climb FOLDER [SEED [STEPS [ds|ss [BUS_FILE [--adverse [RAW...]]]]]]: climbs in the simulation, kinematic
// plant, and leaves in FOLDER what the sensors said and what the module commanded (inputs.bin), every picture that the
// module took (pictures.bin) and, with a bus file, every frame on the drives' buses (can.log).
// --adverse: for twelve seconds under the worst inputs (adverse_sensors.hpp, babbling_bus.hpp), whatever becomes of the
// climb; RAW: cluttered pictures of 640 x 480 raw depths.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include "firmware/config/bus_file.hpp"
#include "firmware/schedule.hpp"
#include "sim_stub/bus/bus_robot.hpp"
#include "sim_stub/bus/candump_log.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/vm/adverse_sensors.hpp"
#include "tests/vm/babbling_bus.hpp"
#include "tests/vm/climb_inputs.hpp"

namespace polygmap::vm {
namespace {

// Stands between the simulated robot and the module.
class Recorder final : public hal::DepthCamera, public hal::Imu, public hal::JointBus, public hal::LidarOdometry {
 public:
  Recorder(const Ports& robot, const std::string& folder)
      : robot_(robot), pictures_(folder + "/pictures.bin", std::ios::binary) {
    CameraIntrinsics intrinsics = robot.camera.intrinsics();
    writer_(kInputsMagic);
    visit_fields(writer_, intrinsics);
  }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot_.camera.intrinsics(); }
  // The module takes a picture at the latest when it needs it; it arrived a latency after its exposure.
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (!robot_.camera.try_acquire(frame)) return false;
    const auto pixels = static_cast<std::streamsize>(frame.width_px) * frame.height_px;
    pictures_.write(reinterpret_cast<const char*>(frame.depth),
                    pixels * static_cast<std::streamsize>(sizeof(std::uint16_t)));
    tick_.has_picture = 1;
    tick_.picture_stamp_ns = frame.stamp_ns;
    tick_.picture_sequence = frame.sequence;
    return true;
  }
  void release() noexcept override { robot_.camera.release(); }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    if (tick_.imu_count == kMaxImuPerTick || !robot_.imu.try_read(sample)) return false;
    tick_.imu[tick_.imu_count++] = sample;
    return true;
  }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (!robot_.joints.try_read(feedback)) return false;
    tick_.has_joints = 1;
    tick_.joints = feedback;
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    tick_.has_command = 1;
    tick_.command = command;
    return robot_.joints.try_write(command);
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return robot_.joints.status(); }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    if (tick_.has_lio != 0 || !robot_.lio.try_read(sample)) return false;
    tick_.has_lio = 1;
    tick_.lio = sample;
    return true;
  }

  void end_tick(std::int64_t now_ns) {
    tick_.now_ns = now_ns;
    visit_fields(writer_, tick_);
    tick_ = {};
  }
  [[nodiscard]] bool write(const std::string& folder) {
    std::ofstream file(folder + "/inputs.bin", std::ios::binary);
    file.write(writer_.bytes().data(), static_cast<std::streamsize>(writer_.bytes().size()));
    return file.flush().good() && pictures_.flush().good();
  }

 private:
  Ports robot_;
  std::ofstream pictures_;
  Writer writer_;
  TickInputs tick_;
};

int record(const std::string& folder, std::uint64_t seed, int steps, bool single_step, const std::string& bus_path) {
  constexpr std::int64_t kLongest_ticks = 100'000;
  sim::SimOptions options;
  options.seed = seed;
  options.stairs.steps = steps;
  sim::SimRobot robot(options);
  Params params;
  if (single_step) params.gait.planner.pattern = GaitPattern::kSingleStep;
  std::optional<sim::CandumpLog> log;
  std::unique_ptr<sim::BusRobot> bus;
  if (!bus_path.empty()) {
    const config::BusFile file = config::read_bus(bus_path);
    config::limit_by_drives(file, params.robot);
    bus = std::make_unique<sim::BusRobot>(robot, file, &log.emplace(folder + "/can.log"));
  }
  Recorder recorder({robot, robot, bus ? static_cast<hal::JointBus&>(bus->joints()) : robot, robot}, folder);
  const auto pipeline = std::make_unique<Pipeline>(Ports{recorder, recorder, recorder, recorder}, params);
  OneLaneExecutive<> executive(*pipeline, robot, pipeline->lane_health(0));
  executive.start(robot.now_ns() + kCycle_ns);
  const GaitStatus& gait = pipeline->control().gait_status();
  std::int64_t ticks = 0;
  while (ticks < kLongest_ticks && gait.phase != GaitPhase::kFinished && gait.phase != GaitPhase::kStopped) {
    bus ? bus->advance() : robot.advance();
    executive.tick(robot.now_ns());
    recorder.end_tick(robot.now_ns());
    ++ticks;
  }
  if (log) log->close();
  std::printf("recorded %lld ticks, %u steps climbed\n", static_cast<long long>(ticks), gait.treads_climbed);
  return recorder.write(folder) && gait.phase == GaitPhase::kFinished ? 0 : 1;
}

// Exits with a sentence where it is none.
AdverseSensors::Raw read_raw(const std::string& path) {
  AdverseSensors::Raw raw(std::size_t{kDepthWidth_px} * kDepthHeight_px);
  const auto bytes = static_cast<std::streamsize>(raw.size() * sizeof raw[0]);
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(raw.data()), bytes)) {
    std::fprintf(stderr, "record_climb: %s is no raw picture of 640 x 480 depths\n", path.c_str());
    std::exit(2);
  }
  return raw;
}

int record_adverse(const std::string& folder, std::uint64_t seed, const std::string& bus_path,
                   std::vector<AdverseSensors::Raw> real) {
  constexpr int kTicks = 6000, kOnlyClutter = 4500;
  sim::SimOptions options;
  options.seed = seed;
  sim::SimRobot robot(options);
  const config::BusFile file = config::read_bus(bus_path);
  Params params;
  config::limit_by_drives(file, params.robot);
  AdverseSensors sensors(robot, std::move(real));
  Recorder recorder({sensors, robot, robot, sensors}, folder);
  BabblingBus bus(file, recorder);
  const auto pipeline = std::make_unique<Pipeline>(Ports{recorder, recorder, bus, recorder}, params);
  OneLaneExecutive<> executive(*pipeline, robot, pipeline->lane_health(0));
  executive.start(robot.now_ns() + kCycle_ns);
  std::size_t polygons = 0;
  for (int tick = 0; tick < kTicks; ++tick) {
    if (tick == kOnlyClutter) sensors.only_clutter();
    robot.advance();
    bus.advance();
    executive.tick(robot.now_ns());
    recorder.end_tick(robot.now_ns());
    polygons = std::max(polygons, pipeline->perception().map_snapshot().polygons.size());
  }
  std::printf("recorded %d ticks, %u steps climbed, at most %zu of %zu polygons in the map\n", kTicks,
              pipeline->control().gait_status().treads_climbed, polygons, MapPolygons::capacity());
  return recorder.write(folder) ? 0 : 1;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) {
  using namespace polygmap::vm;
  if (argc < 2) return std::puts("record_climb FOLDER [SEED [STEPS [ds|ss [BUS_FILE [--adverse [RAW...]]]]]]"), 2;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const int steps = argc > 3 ? std::atoi(argv[3]) : 4;
  const std::string gait = argc > 4 ? argv[4] : "ds", bus = argc > 5 ? argv[5] : "";
  if (argc <= 6) return record(argv[1], seed, steps, gait == "ss", bus);
  std::vector<AdverseSensors::Raw> real;
  for (int i = 7; i < argc; ++i) real.push_back(read_raw(argv[i]));
  return record_adverse(argv[1], seed, bus, std::move(real));
}
