// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/config/daemon_config.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace polygmap::daemon {
namespace {

const std::string kBus = POLYGMAP_SOURCE "/firmware/buses/cubemars.toml";
const std::string kCamera = POLYGMAP_SOURCE "/firmware/cameras/d435.toml";

class DaemonConfigTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  // Lines 1 to 10 of a good file; `more` follows.
  [[nodiscard]] static std::string good(const std::string& more = "") {
    return "bus = \"" + kBus + "\"\n" +              // 1
           "real_time = \"preferred\"\n" +           // 2
           "[control]\ncpu = 4\npriority = 81\n" +   // 3-5
           "[camera]\ndevice = \"/dev/video9\"\n" +  // 6-7
           "file = \"" + kCamera + "\"\n" +          // 8
           "[imu]\ndriver = \"livox\"\n" + more;     // 9-10
  }
  [[nodiscard]] std::string complaint(const std::string& text) {
    try {
      (void)read_daemon_config(write("robot.toml", text));
    } catch (const config::FileError& error) {
      return error.what();
    }
    return {};
  }
  [[nodiscard]] static std::string replaced(std::string text, const std::string& what, const std::string& by) {
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return text.replace(at, what.size(), by);
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("polygmap_daemon_config_" + std::to_string(::getpid()));
};

TEST_F(DaemonConfigTest, GoodFile_HasWhatItSaysAndDefaultsElsewhere) {
  const std::string more =
      "base_rpy_rad = [0.0, 0.0, 1.5707963267948966]\nsender = \"192.168.1.50\"\nleast_delay_ms = 1.5\n"
      "[lio]\nport = 5601\nclock = \"own\"\n[perception]\ncpu = 5\n";
  const DaemonConfig config = read_daemon_config(write("robot.toml", good(more)));
  EXPECT_EQ(config.bus.buses.size(), 4U);
  EXPECT_FALSE(config.needs_real_time);
  EXPECT_EQ(config.lanes, 2U);
  EXPECT_EQ(config.placement[kControlLane].processor, 4);
  EXPECT_EQ(config.placement[kControlLane].priority, 81);
  EXPECT_EQ(config.placement[kPerceptionLane].processor, 5);
  EXPECT_EQ(config.placement[kPerceptionLane].priority, 75);
  EXPECT_EQ(config.camera.intrinsics.width_px, 640);
  EXPECT_EQ(config.camera.device.view(), "/dev/video9");
  EXPECT_DOUBLE_EQ(config.params.surfaces.noise.quadratic_per_m, 0.0042);
  EXPECT_DOUBLE_EQ(config.params.surfaces.limits.max_depth_m, 4.0);
  const auto& imu = std::get<hal::LivoxImu::Config>(config.imu);
  EXPECT_EQ(imu.udp.port, 56401);
  EXPECT_EQ(imu.udp.sender.view(), "192.168.1.50");
  EXPECT_EQ(config.params.imu_interval_ns, 5 * kNsPerMs) << "200 Hz";
  EXPECT_EQ(imu.time.base, hal::TimeBase::kEstimated);
  EXPECT_EQ(imu.time.offset.least_delay_ns, 1'500'000);
  EXPECT_NEAR((imu.base_R_imu * Vec3::UnitX() - Vec3::UnitY()).norm(), 0.0, 1e-12);
  ASSERT_TRUE(config.lio.has_value());
  EXPECT_EQ(config.lio->udp.port, 5601);
  EXPECT_EQ(config.lio->time.base, hal::TimeBase::kEstimated);
}

TEST_F(DaemonConfigTest, PerceptionThatCouldHoldControlUp_IsRefused) {
  const std::string pose = "base_rpy_rad = [0.0, 0.0, 0.0]\n";
  const auto placed = [&](const std::string& perception) {
    return complaint(good(pose + "[perception]\n" + perception));
  };
  const std::string says =
      "lets perception hold control up: on processor 4, which is control's, its priority must be below control's 81";
  for (const char* const priority : {"81", "82"}) {
    const std::string said = placed(std::string("cpu = 4\npriority = ") + priority + "\n");
    EXPECT_NE(said.find("robot.toml\", line 14: perception.priority " + says), std::string::npos) << said;
  }
  EXPECT_EQ(placed("cpu = 4\npriority = 80\n"), "");
  EXPECT_EQ(placed("cpu = 5\npriority = 90\n"), "");
  EXPECT_EQ(placed("priority = 90\n"), "");
  const std::string low_control = replaced(good(pose + "[perception]\ncpu = 4\n"), "priority = 81", "priority = 75");
  EXPECT_NE(complaint(low_control).find("perception.cpu lets perception hold"), std::string::npos)
      << complaint(low_control);
}

TEST_F(DaemonConfigTest, DrivesOfTheBusFile_LimitTheGains) {
  const DaemonConfig config = read_daemon_config(write("robot.toml", good()));
  EXPECT_DOUBLE_EQ(config.params.robot.drives.gain_limits[0].kp_nmprad, 500.0);
}

TEST_F(DaemonConfigTest, SerialImu_TakesItsOwnKeys) {
  const std::string text = replaced(good("device = \"/dev/ttyTHS1\"\nbaud = 460800\n"), "\"livox\"", "\"serial\"");
  EXPECT_EQ(read_daemon_config(write("robot.toml", text + "rate_hz = 100\n")).params.imu_interval_ns, 10 * kNsPerMs);
  const DaemonConfig config = read_daemon_config(write("robot.toml", text));
  EXPECT_EQ(config.params.imu_interval_ns, kCycle_ns);
  const auto& imu = std::get<hal::SerialImu::Config>(config.imu);
  EXPECT_EQ(imu.device.view(), "/dev/ttyTHS1");
  EXPECT_EQ(imu.baud, 460'800U);
}

TEST_F(DaemonConfigTest, PathsAreRelativeToTheFile) {
  std::filesystem::copy_file(kBus, folder_ / "legs.toml");
  std::filesystem::copy_file(kCamera, folder_ / "eye.toml");
  write("mine.toml", "[gait.planner]\nstand_off_m = 0.03\n");
  std::string text = replaced(good(), kBus, "legs.toml");
  text = "params = \"mine.toml\"\n" + replaced(text, kCamera, "eye.toml");
  const DaemonConfig config = read_daemon_config(write("robot.toml", text));
  EXPECT_DOUBLE_EQ(config.params.gait.planner.stand_off_m, 0.03);
}

TEST_F(DaemonConfigTest, DevicesKnowWhereTheyWereNamed) {
  const DaemonConfig config = read_daemon_config(write("robot.toml", good()));
  EXPECT_TRUE(config.places.camera.ends_with("robot.toml, line 7, camera.device")) << config.places.camera;
  ASSERT_EQ(config.places.buses.size(), 4U);
  EXPECT_TRUE(config.places.buses[0].find("cubemars.toml, line ") != std::string::npos) << config.places.buses[0];
}

TEST_F(DaemonConfigTest, WhoMaySend_IsWarnedOfWhereNobodyIsNamed) {
  const std::string lio = "sender = \"192.168.1.50\"\n[lio]\nport = 5601\n";
  EXPECT_TRUE(read_daemon_config(write("robot.toml", good(lio + "sender = \"127.0.0.1\"\n"))).warnings.empty());
  const std::vector<std::string> warnings = read_daemon_config(write("robot.toml", good(lio))).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("robot.toml, line 13, lio.port: without a sender"), std::string::npos) << warnings[0];
}

// The shipped unit grants what the file may ask for, and what the shipped file does.
TEST_F(DaemonConfigTest, ShippedUnit_GrantsWhatTheFilesTake) {
  const auto text_of = [](const std::string& path) {
    std::ifstream file(std::string(POLYGMAP_SOURCE "/toolchain/package/") + path);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string unit = text_of("polygmapd.service");
  EXPECT_NE(unit.find("\nLimitRTPRIO=" + std::to_string(kMostPriority) + "\n"), std::string::npos);
  const auto priority = [this](int value) {
    return complaint(replaced(good(), "priority = 81", "priority = " + std::to_string(value)));
  };
  EXPECT_EQ(priority(kMostPriority), "");
  EXPECT_NE(priority(kMostPriority + 1), "");
  const std::string shipped =
      replaced(replaced(text_of("polygmapd.toml"), "/usr/share/polygmap/buses/cubemars.toml", kBus),
               "/usr/share/polygmap/cameras/d435.toml", kCamera);
  const DaemonConfig config = read_daemon_config(write("polygmapd.toml", shipped));
  EXPECT_TRUE(config.warnings.empty()) << config.warnings[0];
  EXPECT_EQ(config.operator_socket, "/run/polygmap/operator");
  EXPECT_EQ(config.mailbox, "/polygmap");
  EXPECT_FALSE(config.params.supervisor.autostart) << "no robot walks off by itself";
  EXPECT_NE(unit.find("\nRuntimeDirectory=polygmap\n"), std::string::npos);
  EXPECT_TRUE(read_daemon_config(write("robot.toml", good())).params.supervisor.autostart);
  EXPECT_NE(unit.find("\nIPAddressDeny=any\nIPAddressAllow=localhost 192.168.1.0/24\n"), std::string::npos);
  EXPECT_TRUE(std::get<hal::LivoxImu::Config>(config.imu).udp.sender.view().starts_with("192.168.1."));
  EXPECT_TRUE(config.lio->udp.sender.view().starts_with("127."));
}

// A change of the good file, and what the one sentence says of it.
struct Wrong {
  const char* name;
  const char* what;
  const char* by;
  const char* says;
};
class DaemonConfigWrong : public DaemonConfigTest, public testing::WithParamInterface<Wrong> {};

TEST_P(DaemonConfigWrong, IsToldInOneSentenceWithFileLineAndKey) {
  const Wrong& wrong = GetParam();
  const std::string said = complaint(replaced(good(), wrong.what, wrong.by));
  EXPECT_NE(said.find(wrong.says), std::string::npos) << said;
  EXPECT_NE(said.find("robot.toml"), std::string::npos) << said;
  EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  EXPECT_TRUE(said.ends_with('.')) << said;
}

INSTANTIATE_TEST_SUITE_P(
    Each, DaemonConfigWrong,
    testing::Values(
        Wrong{"key", "cpu = 4", "core = 4", "line 4: control.core is no key of control; there are cpu, priority"},
        Wrong{"top_key", "real_time", "realtime", "line 2: realtime is no key of a daemon file"},
        Wrong{"type", "cpu = 4", "cpu = \"4\"", "line 4: control.cpu must be a number"},
        Wrong{"fraction", "cpu = 4", "cpu = 4.5", "line 4: control.cpu must be a whole number, not 4.5"},
        Wrong{"range", "priority = 81", "priority = 100", "line 5: control.priority must be from 1 to 98, not 100"},
        Wrong{"not_a_number", "priority = 81", "priority = nan", "line 5: control.priority must be from 1 to 98"},
        Wrong{"word", "\"preferred\"", "\"maybe\"",
              "line 2: real_time must be \"required\" or \"preferred\", not \"maybe\""},
        Wrong{"text", "\"preferred\"", "true", "line 2: real_time must be a text in quotes"},
        Wrong{"missing", "device = \"/dev/video9\"\n", "", "line 6: camera.device is missing"},
        Wrong{"empty_path", "/dev/video9", "", "line 7: camera.device must be a path of 1 to 63 characters"},
        Wrong{"table", "[control]\ncpu = 4\npriority = 81", "control = 4\n\n",
              "line 3: control must be a table: [control]"},
        Wrong{"no_table", "[imu]\ndriver = \"livox\"\n", "", "line 1: imu is missing"},
        Wrong{"driver", "\"livox\"", "\"bosch\"", "line 10: imu.driver must be \"livox\" or \"serial\", not \"bosch\""},
        Wrong{"other_drivers_key", "driver = \"livox\"", "driver = \"livox\"\nbaud = 9600",
              "line 11: imu.baud is no key of imu"},
        Wrong{"address", "driver = \"livox\"", "driver = \"livox\"\nsender = \"lidar\"",
              "line 11: imu.sender must be an address such as"},
        Wrong{"port", "driver = \"livox\"", "driver = \"livox\"\nport = 65536",
              "line 11: imu.port must be from 1 to 65535, not 65536"},
        Wrong{"rate", "driver = \"livox\"", "driver = \"livox\"\nrate_hz = 20",
              "line 11: imu.rate_hz must be from 100 to 1000 Hz, not 20"},
        Wrong{"vector", "driver = \"livox\"", "driver = \"livox\"\nbase_rpy_rad = [1, 2]",
              "line 11: imu.base_rpy_rad must be three numbers in brackets"},
        Wrong{"lane", "real_time = \"preferred\"", "lanes = 3", "line 2: lanes must be from 1 to 2, not 3"},
        Wrong{"mailbox", "real_time = \"preferred\"", "mailbox = \"polygmap\"",
              "line 2: mailbox must be a name as in \"/polygmap\""},
        Wrong{"mailbox_folder", "real_time = \"preferred\"", "mailbox = \"/a/b\"", "line 2: mailbox must be a name"},
        Wrong{"mailbox_group", "real_time = \"preferred\"", "mailbox_group = \"robot\"",
              "line 2: mailbox_group needs the key mailbox"},
        Wrong{"syntax", "cpu = 4", "cpu = ", "line 4"},
        Wrong{"bus", "cubemars.toml", "nobodys.toml", "line 1: bus names no file"},
        Wrong{"camera", "d435.toml", "nobodys.toml", "line 8: camera.file names no file"}),
    [](const testing::TestParamInfo<Wrong>& of) { return std::string(of.param.name); });

TEST_F(DaemonConfigTest, WrongFileThatItNames_IsToldWithThatFilesName) {
  const std::string bus = write("legs.toml", "bitrate = 1\n");
  EXPECT_NE(complaint(replaced(good(), kBus, bus)).find("legs.toml\", line 1"), std::string::npos);
  const std::string params = write("mine.toml", "\n[gait]\nnonsense = 1\n");
  EXPECT_NE(complaint("params = \"" + params + "\"\n" + good()).find("mine.toml\", line 3"), std::string::npos);
}

TEST_F(DaemonConfigTest, DrivesThatCannotHoldTheRobot_AreRefused) {
  const std::string said = complaint(replaced(good(), "cubemars", "ruiwo"));
  EXPECT_NE(said.find("the robot cannot stand on one leg"), std::string::npos) << said;
}

TEST_F(DaemonConfigTest, OneLane_HasNoPlaceForPerception) {
  const std::string said = complaint("lanes = 1\n" + good("[perception]\ncpu = 5\n"));
  EXPECT_NE(said.find("line 12: perception places a lane that lanes = 1 does not have"), std::string::npos) << said;
}

TEST_F(DaemonConfigTest, CameraLargerThanTheModule_IsRefused) {
  std::ifstream file(kCamera);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const std::string camera = write("eye.toml", replaced(text, "width = 640", "width = 648"));
  const std::string said = complaint(replaced(good(), kCamera, camera));
  EXPECT_NE(said.find("line 8: camera.file has a camera of 648 x 480 pixels"), std::string::npos) << said;
}

TEST_F(DaemonConfigTest, NoFileAndAFolder_AreTold) {
  for (const std::string& path : {(folder_ / "none.toml").string(), folder_.string()}) {
    try {
      (void)read_daemon_config(path);
      ADD_FAILURE() << path;
    } catch (const config::FileError& error) {
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace polygmap::daemon
