// SPDX-License-Identifier: Apache-2.0
// The shipped files, changed at random: each reader takes what is within the ranges that it declares, and of anything
// else says one sentence with file and line that a terminal can show.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <regex>
#include <variant>

#include "firmware/config/bus_file.hpp"
#include "firmware/config/camera_file.hpp"
#include "firmware/config/param_file.hpp"
#include "firmware/daemon/config/daemon_config.hpp"
#include "tests/firmware/daemon/text_mutator.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::daemon {
namespace config_fuzz_test {
namespace {

constexpr int kShort = test::kSlowMachine ? 1'000 : 5'000, kLong = 1'000'000;

std::string text_of(const std::string& path) {
  std::ifstream file(POLYGMAP_SOURCE "/" + path);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Of these no line is to blame.
constexpr std::array<std::string_view, 9> kOfTheWholeFile{
    " is missing.",        " [[drive]] tables, and", " looks like a ", " must be less than max_depth_m", " reach ",
    " frames of a cycle ", " with these drives ",    "'s p, ",         " is no key of a camera"};

void expect_sentence(const std::string& sentence, const std::string& path, std::string_view text) {
  ASSERT_TRUE(sentence.ends_with('.') && !sentence.ends_with("..")) << sentence;
  ASSERT_TRUE(std::ranges::none_of(sentence, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }))
      << sentence;
  ASSERT_NE(sentence.find(path), std::string::npos) << sentence;
  const std::size_t at = sentence.find(", line ");
  if (at == std::string::npos) {
    ASSERT_TRUE(std::ranges::any_of(kOfTheWholeFile, [&](std::string_view words) {
      return sentence.find(words) != std::string::npos;
    })) << sentence;
    return;
  }
  const long line = std::atol(sentence.c_str() + at + 7);
  ASSERT_TRUE(line >= 1 && line <= 1 + std::ranges::count(text, '\n')) << sentence;
}

// How many of the runs were taken. read(text): takes it and looks at what it got, or throws FileError.
template <class Read>
int fuzz_file(const std::string& good, const std::string& path, int runs, unsigned seed, Read&& read) {
  test::TextMutator mutator(seed);
  int taken = 0;
  for (int run = 0; run < runs && !testing::Test::HasFatalFailure(); ++run) {
    const std::string text = mutator.mutated(good);
    try {
      read(text);
      ++taken;
    } catch (const config::FileError& error) {
      expect_sentence(error.what(), path, text);
    }
    if (testing::Test::HasFatalFailure()) std::fprintf(stderr, "run %d of seed %u:\n%s\n", run, seed, text.c_str());
  }
  return taken;
}
// Both: it tried what is behind the first look.
void expect_some(int taken, int runs) {
  EXPECT_GT(taken, runs / 100);
  EXPECT_LT(taken, runs - runs / 100);
}
bool within(double x, double least, double most) { return x >= least && x <= most; }

void expect_camera(const config::CameraProfile& camera) {
  const CameraIntrinsics& k = camera.intrinsics;
  ASSERT_TRUE(within(k.width_px, config::kLeastSide_px, config::kMaxWidth_px));
  ASSERT_TRUE(within(k.height_px, config::kLeastSide_px, config::kMaxHeight_px));
  ASSERT_TRUE(within(k.fx_px, 1.0, 1e5) && within(k.fy_px, 1.0, 1e5));
  ASSERT_TRUE(within(k.cx_px, -1e5, 1e5) && within(k.cy_px, -1e5, 1e5));
  ASSERT_TRUE(within(k.depth_unit_m, 1e-6, 0.1));
  ASSERT_TRUE(camera.min_depth_m >= 0.001 && camera.min_depth_m < camera.max_depth_m && camera.max_depth_m <= 1000.0);
  const DepthNoiseModel& noise = camera.noise;
  ASSERT_TRUE(within(noise.base_m, 1e-6, 1.0) && within(noise.per_metre, 0.0, 1.0));
  ASSERT_TRUE(within(noise.quadratic_per_m, 0.0, 1.0) && within(noise.correlated_share, 0.0, 1.0));
  ASSERT_TRUE(within(noise.correlated_px, 1.0, 1e6));
}
void fuzz_camera(int runs, unsigned seed) {
  const std::string path = "eye.toml";
  const int taken = fuzz_file(text_of("firmware/cameras/d435.toml"), path, runs, seed,
                              [&](const std::string& text) { expect_camera(config::parse_camera(path, text)); });
  expect_some(taken, runs);
}
TEST(CameraFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_camera(kShort, 1); }
TEST(LongFuzzCameraFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_camera(kLong, 2); }

void expect_bus(const config::BusFile& bus) {
  const hal::DriveTable& table = bus.table;
  ASSERT_TRUE(within(static_cast<double>(bus.buses.size()), 1, hal::kMaxBuses));
  ASSERT_TRUE(bus.buses.size() == table.bus_count && bus.buses.size() == bus.bus_lines.size());
  ASSERT_TRUE(within(table.bitrate_bps, 10'000, 1'000'000));
  for (std::size_t i = 0; i < bus.buses.size(); ++i) {
    ASSERT_TRUE(!bus.buses[i].empty() && bus.buses[i].size() <= 15) << bus.buses[i];
    ASSERT_LE(hal::bus_load(table, i), hal::kMaxBusLoad);
  }
  for (const hal::CanDrive& drive : table.drives) {
    ASSERT_LT(drive.bus, table.bus_count);
    ASSERT_TRUE(within(drive.id, 1, drive.reply == hal::MitReplyRule::kStatusNibble ? 15 : 255));
    ASSERT_LE(drive.reply_id, hal::kMaxCanId);
    const hal::MitRanges& ranges = drive.ranges;
    ASSERT_TRUE(within(ranges.p_rad, 0.1, 1000.0) && within(ranges.v_radps, 0.1, 1000.0));
    ASSERT_TRUE(within(ranges.t_nm, 0.1, 10'000.0) && within(ranges.kp_nmprad, 0.1, 100'000.0));
    ASSERT_TRUE(within(ranges.kd_nmsprad, 0.001, 10'000.0));
    for (const hal::CanDrive& other : table.drives) {
      ASSERT_TRUE(&other == &drive || other.bus != drive.bus || (other.id != drive.id && other.id != drive.reply_id));
    }
  }
  if (!table.feet.present) return;
  ASSERT_TRUE(table.feet.bus < table.bus_count && within(table.feet.id, 1, hal::kMaxCanId));
  ASSERT_TRUE(within(table.feet.unit_n, 1e-4, 100.0));
}
void fuzz_bus(int runs, unsigned seed) {
  const std::string path = "legs.toml";
  int taken = 0;
  for (const char* name : {"cubemars", "damiao"}) {
    const std::string good = text_of(std::string("firmware/buses/") + name + ".toml");
    taken += fuzz_file(good, path, runs / 2, seed++, [&](const std::string& text) {
      const config::BusFile bus = config::parse_bus(path, text);
      expect_bus(bus);
      if (seed % 2 != 0) return;
      RobotModel robot;
      config::limit_by_drives(bus, robot);
    });
  }
  expect_some(taken, runs);
}
TEST(BusFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_bus(kShort, 1); }
TEST(LongFuzzBusFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_bus(kLong, 3); }

struct IsWithin {
  const config::Param& param;
  bool operator()(config::EnumValue choice) const { return *choice.value < choice.names.size(); }
  bool operator()(config::RotationValue rotation) const {
    return (*rotation.value * rotation.value->transpose() - Mat3::Identity()).norm() < 1e-9;
  }
  bool operator()(std::span<double> values) const {
    return std::ranges::all_of(values, [&](double x) { return within(x, param.least, param.most); });
  }
  bool operator()(const auto*) const { return within(config::number_of(param), param.least, param.most); }
};
void expect_params(const config::ParamTable& table) {
  for (const config::Param& param : table.params) ASSERT_TRUE(std::visit(IsWithin{param}, param.value)) << param.name;
  const auto value_of = [&](const std::string& name) {
    return config::number_of(*std::ranges::find(table.params, name, &config::Param::name));
  };
  for (const config::ParamOrder& order : table.orders) ASSERT_LE(value_of(order.less), value_of(order.more));
}
// Of every kind one: numbers, whole ones, a bool, a choice, an array, a rotation, and two that are ordered.
constexpr const char* kParams = R"(# what differs from the module's own
tread_height_sigma_m = 0.004
[gait.planner]
stand_off_m = 0.03
pattern = "single_step"
)";
void fuzz_params(int runs, unsigned seed) {
  const std::string path = "params.toml";
  Params params;
  const Params otherwise;
  const config::ParamTable table = config::param_table(params);
  int looked_at = 0;
  const int taken = fuzz_file(kParams, path, runs, seed, [&](const std::string& text) {
    params = otherwise;
    config::parse_params({"parameter", path}, text, table);
    if (++looked_at % 20 == 0) expect_params(table);
  });
  expect_some(taken, runs);
}
TEST(ParamFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_params(kShort, 1); }
TEST(LongFuzzParamFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_params(kLong, 2); }

void expect_daemon(const DaemonConfig& config) {
  ASSERT_TRUE(config.lanes == 1 || config.lanes == 2);
  for (const LaneThread::Placement& placement : config.placement) {
    ASSERT_TRUE(within(placement.processor, -1, 1023) && within(placement.priority, 1, kMostPriority));
  }
  ASSERT_TRUE(within(static_cast<double>(config.hold_ns), 0, 86400e9));
  ASSERT_TRUE(!config.camera.device.empty() && config.camera.device.view().size() < 64);
  ASSERT_TRUE(within(config.camera.buffers, 4, hal::BufferBook::kMostBuffers) && config.camera.frames_per_s <= 1000);
  ASSERT_TRUE(within(static_cast<double>(config.camera.timeout_ns), 10e6, 60e9));
  const auto expect_time = [](const hal::SampleClock::Params& time) {
    ASSERT_TRUE(within(static_cast<double>(time.offset.least_delay_ns), 0, 1e9));
  };
  if (const auto* livox = std::get_if<hal::LivoxImu::Config>(&config.imu)) {
    ASSERT_TRUE(livox->udp.port >= 1 && livox->base_R_imu.allFinite());
    expect_time(livox->time);
  } else {
    const auto& serial = std::get<hal::SerialImu::Config>(config.imu);
    ASSERT_TRUE(within(serial.baud, 9600, 4'000'000) && !serial.device.empty() && serial.base_R_imu.allFinite());
    expect_time(serial.time);
  }
  if (config.lio) {
    ASSERT_GE(config.lio->udp.port, 1);
    expect_time(config.lio->time);
  }
}
void fuzz_daemon(int runs, unsigned seed) {
  const std::string path = POLYGMAP_SOURCE "/toolchain/package/robot.toml";  // its files are beside it: none is written
  std::string good = text_of("toolchain/package/polygmapd.toml");
  for (const char* folder : {"buses", "cameras"}) {
    const std::string installed = std::string("/usr/share/polygmap/") + folder;
    good.replace(good.find(installed), installed.size(), std::string("../../firmware/") + folder);
  }
  const int taken = fuzz_file(good, path, runs, seed,
                              [&](const std::string& text) { expect_daemon(parse_daemon_config(path, text)); });
  expect_some(taken, runs);
}
TEST(DaemonFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_daemon(kShort, 1); }
TEST(LongFuzzDaemonFile, AnyText_IsWithinItsRangesOrASentence) { fuzz_daemon(kLong, 2); }

}  // namespace
}  // namespace config_fuzz_test
}  // namespace polygmap::daemon
