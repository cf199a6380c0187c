// SPDX-License-Identifier: Apache-2.0
// render_climb FILE SEED STEPS ds|ss BUS_FILE PERIOD_TICKS: climbs in the simulation, kinematic plant, behind the CAN
// buses of the file, and leaves in FILE what its camera would see in every so many ticks (picture_book.hpp).
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <memory>
#include <string>

#include "firmware/config/bus_file.hpp"
#include "firmware/schedule.hpp"
#include "sim_stub/bus/bus_robot.hpp"
#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/vm/picture_book.hpp"

namespace polygmap::vm {
namespace {

constexpr std::int64_t kLongest_ticks = 100'000, kHalfScan_ticks = 4;  // as the simulated camera scans

class BookWriter {
 public:
  BookWriter(const sim::SimRobot& robot, std::uint64_t seed, std::int64_t period_ticks)
      : robot_(robot),
        period_ticks_(period_ticks),
        solids_(sim::stair_solids(robot.stairs())),
        renderer_(robot.depth_camera().intrinsics()),
        noise_({.scale = robot.errors().depth_scale, .strength = sim::ErrorParams{}.depth_noise},
               robot.depth_camera().intrinsics(), seed) {}

  // Once a tick.
  void look() {
    const Transform& base_T_camera = robot_.errors().base_T_camera;
    const sim::Truth& truth = robot_.truth();
    past_.push_back({{truth.true_T_base * base_T_camera, solids_, truth.base_legs, base_T_camera, true},
                     PictureKey::of(truth.true_T_base, robot_.true_q_rad())});
    if (past_.size() > 2 * kHalfScan_ticks + 1) past_.pop_front();
    const std::int64_t middle = tick_++ - kHalfScan_ticks;
    if (middle < kHalfScan_ticks || middle % period_ticks_ != 0) return;
    renderer_.render(past_.front().scene, past_.back().scene);
    const auto pixels = static_cast<std::size_t>(renderer_.intrinsics().width_px) *
                        static_cast<std::size_t>(renderer_.intrinsics().height_px);
    pixels_.resize(pixels_.size() + pixels);
    noise_.apply(renderer_, keys_.size(), 0.002 * static_cast<double>(middle),
                 pixels_.data() + pixels_.size() - pixels);
    keys_.push_back(past_[kHalfScan_ticks].key);
  }
  [[nodiscard]] bool write(const std::string& path) const {
    const BookHeader header{.count = keys_.size(), .picture_px = pixels_.size() / keys_.size()};
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(&header), sizeof header);
    file.write(reinterpret_cast<const char*>(keys_.data()),
               static_cast<std::streamsize>(keys_.size() * sizeof(PictureKey)));
    file.write(reinterpret_cast<const char*>(pixels_.data()),
               static_cast<std::streamsize>(pixels_.size() * sizeof(std::uint16_t)));
    return file.flush().good();
  }
  [[nodiscard]] std::size_t count() const noexcept { return keys_.size(); }

 private:
  struct Moment {
    sim::DepthScene scene;
    PictureKey key;
  };
  const sim::SimRobot& robot_;
  std::int64_t period_ticks_, tick_ = 0;
  std::vector<sim::SolidBox> solids_;
  std::deque<Moment> past_;
  sim::DepthRenderer renderer_;
  sim::CameraNoise noise_;
  std::vector<PictureKey> keys_;
  std::vector<std::uint16_t> pixels_;
};

int render(const std::string& path, std::uint64_t seed, int steps, bool single_step, const std::string& bus_path,
           std::int64_t period_ticks) {
  sim::SimOptions options;
  options.seed = seed;
  options.stairs.steps = steps;
  sim::SimRobot robot(options);
  Params params;
  if (single_step) params.gait.planner.pattern = GaitPattern::kSingleStep;
  const config::BusFile file = config::read_bus(bus_path);
  config::limit_by_drives(file, params.gait.joints, params.robot);
  sim::BusRobot bus(robot, file, nullptr);
  BookWriter book(robot, seed, period_ticks);
  const auto pipeline = std::make_unique<Pipeline>(Ports{robot, robot, bus.joints(), robot}, params);
  OneLaneExecutive<> executive(*pipeline, robot, pipeline->lane_health(0));
  executive.start(robot.now_ns() + kCycle_ns);
  const GaitStatus& gait = pipeline->control().gait_status();
  std::int64_t ticks = 0;
  while (ticks < kLongest_ticks && gait.phase != GaitPhase::kFinished && gait.phase != GaitPhase::kStopped) {
    bus.advance();
    executive.tick(robot.now_ns());
    book.look();
    ++ticks;
  }
  std::printf("rendered %zu pictures of %lld ticks, %u steps climbed\n", book.count(), static_cast<long long>(ticks),
              gait.treads_climbed);
  return book.write(path) && gait.phase == GaitPhase::kFinished ? 0 : 1;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) {
  if (argc != 7) return std::puts("render_climb FILE SEED STEPS ds|ss BUS_FILE PERIOD_TICKS"), 2;
  return polygmap::vm::render(argv[1], std::strtoull(argv[2], nullptr, 10), std::atoi(argv[3]),
                              std::string(argv[4]) == "ss", argv[5], std::atoi(argv[6]));
}
