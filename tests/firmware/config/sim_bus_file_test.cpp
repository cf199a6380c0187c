// SPDX-License-Identifier: Apache-2.0
// Bus files: what they may say, and the one sentence about what they may not.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "firmware/config/bus_file.hpp"

namespace polygmap::config {
namespace {

std::string shipped(const std::string& name) { return std::string(POLYGMAP_BUSES) + "/" + name + ".toml"; }

std::string write_bus_file(const std::string& text) {
  const std::string path =
      testing::TempDir() + "polygmap_bus_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml";
  std::ofstream(path) << text;
  return path;
}

struct Drive {
  std::string bus = "\"can0\"", id = "1", reply_id = "0", rest = "p = 12.5\nv = 8\nt = 144\nkp = 500\nkd = 5\n";
  std::string more;
};
std::array<Drive, kJointCount> drives() {
  std::array<Drive, kJointCount> all;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    all[n].bus = "\"can" + std::to_string(n / 3) + "\"";
    all[n].id = std::to_string(n + 1);
  }
  return all;
}
std::string text_of(std::span<const Drive> drives, const std::string& more = "") {
  std::string text;
  for (const Drive& d : drives) {
    text += "[[drive]]\nbus = " + d.bus + "\nid = " + d.id + "\nreply_id = " + d.reply_id + "\n" + d.rest + d.more;
  }
  return text + more;
}

// Refused in one sentence that names the file and says this.
void expect_bus_file_refused(const std::string& text, const std::string& what) {
  const std::string path = write_bus_file(text);
  try {
    (void)read_bus(path);
    ADD_FAILURE() << "taken, not refused for " << what;
  } catch (const FileError& error) {
    const std::string sentence = error.what();
    EXPECT_NE(sentence.find(path), std::string::npos) << sentence;
    EXPECT_NE(sentence.find(what), std::string::npos) << sentence;
    EXPECT_TRUE(sentence.ends_with(".")) << sentence;
    EXPECT_EQ(std::count(sentence.begin(), sentence.end(), '\n'), 0) << sentence;
  }
}

TEST(BusFile, ShippedFiles_AreReadAndWithinTheLoad) {
  for (const char* name : {"cubemars", "damiao", "ruiwo"}) {
    const BusFile bus = read_bus(shipped(name));
    EXPECT_EQ(bus.buses, (std::vector<std::string>{"can0", "can1", "can2", "can3"}));
    EXPECT_EQ(bus.table.bus_count, 4);
    EXPECT_EQ(bus.table.bitrate_bps, 1000000U);
    EXPECT_TRUE(bus.table.feet.present);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LE(hal::bus_load(bus.table, i), hal::kMaxBusLoad);
    EXPECT_EQ(bus.table.drives[3].bus, 1);
    EXPECT_EQ(bus.table.drives[11].id, 12);
  }
  const BusFile ruiwo = read_bus(shipped("ruiwo"));
  EXPECT_EQ(ruiwo.table.drives[0].ranges.kp_nmprad, 250.0);
  EXPECT_EQ(ruiwo.table.drives[0].ranges.kd_nmsprad, 50.0);
  EXPECT_EQ(read_bus(shipped("damiao")).table.drives[0].reply, hal::MitReplyRule::kStatusNibble);
}

TEST(BusFile, GoodFile_HasWhatItSays) {
  auto all = drives();
  all[4].more = "reply = \"status_nibble\"\n";
  all[4].reply_id = "0x25";
  const BusFile bus = read_bus(
      write_bus_file("bitrate = 800_000\n" + text_of(all, "[feet]\nbus = \"can9\"\nid = 0x70\nunit_n = 0.1\n")));
  EXPECT_EQ(bus.table.bitrate_bps, 800000U);
  EXPECT_EQ(bus.buses.back(), "can9");
  EXPECT_EQ(bus.table.feet.bus, 4);
  EXPECT_EQ(bus.table.feet.id, 0x70);
  EXPECT_EQ(bus.table.feet.unit_n, 0.1);
  EXPECT_EQ(bus.table.drives[4].reply_id, 0x25);
  EXPECT_EQ(bus.table.drives[4].reply, hal::MitReplyRule::kStatusNibble);
  EXPECT_EQ(bus.table.drives[3].ranges.v_radps, 8.0);
}

TEST(BusFile, WrongKeysTypesAndRanges_AreNamedWithTheirLine) {
  expect_bus_file_refused("drive = 3\n", "line 1: there must be a [[drive]] table for each joint");
  expect_bus_file_refused("", "there must be a [[drive]] table for each joint");
  expect_bus_file_refused("bitrate = \n", "line 1: ");
  expect_bus_file_refused("bitrate = 2_000_000\n", "line 1: bitrate must be from 10000 to 1000000 bit/s, not 2000000");
  expect_bus_file_refused("bitrate = 250000.5\n", "bitrate must be a whole number");
  expect_bus_file_refused("bitrat = 250000\n",
                          "line 1: \"bitrat\" is no key of a bus file; there are bitrate, drive, feet");
  const auto with = [](auto change) {
    auto all = drives();
    change(all);
    return text_of(all);
  };
  expect_bus_file_refused(with([](auto& d) { d[1].bus = "3"; }), "line 11: left_hip_yaw: bus must be a text in quotes");
  expect_bus_file_refused(with([](auto& d) { d[1].bus = "\"c/n\""; }),
                          "bus must name an interface such as \"can0\", not \"c/n\"");
  expect_bus_file_refused(with([](auto& d) { d[0].id = "0"; }),
                          "line 3: left_hip_roll: id must be from 1 to 255, not 0");
  expect_bus_file_refused(with([](auto& d) { d[0].id = "1.5"; }), "left_hip_roll: id must be a whole number, not 1.5");
  expect_bus_file_refused(with([](auto& d) { d[0].id = "true"; }), "line 3: left_hip_roll: id must be a number");
  expect_bus_file_refused(with([](auto& d) { d[0].reply_id = "2048"; }), "reply_id must be from 0 to 2047, not 2048");
  expect_bus_file_refused(with([](auto& d) { d[0].more = "x = 1\n"; }), "line 10: \"x\" is no key of a drive");
  expect_bus_file_refused(with([](auto& d) { d[2].rest = "p = 12.5\nv = 8\nt = 144\nkp = 500\n"; }),
                          "left_hip_pitch: kd is missing");
  expect_bus_file_refused(with([](auto& d) { d[2].rest = "p = nan\nv = 8\nt = 144\nkp = 500\nkd = 5\n"; }),
                          "left_hip_pitch: p must be from 0.1 to 1000 rad, not");
  expect_bus_file_refused(with([](auto& d) { d[2].rest = "p = 12.5\nv = 8\nt = -1\nkp = 500\nkd = 5\n"; }),
                          "left_hip_pitch: t must be from 0.1 to 10000 Nm, not -1");
  expect_bus_file_refused(with([](auto& d) { d[2].more = "reply = \"nibble\"\n"; }),
                          "reply must be \"id\" or \"status_nibble\", not \"nibble\"");
  expect_bus_file_refused(with([](auto& d) {
                            d[4].more = "reply = \"status_nibble\"\n";
                            d[4].id = "17";
                          }),
                          "left_ankle_pitch: id must be from 1 to 15, not 17");
  expect_bus_file_refused(text_of(drives(), "[feet]\nbus = \"can0\"\nid = 1\nunit_n = 0.1\n"),
                          "feet: id 1 is left_hip_roll's on can0");
  expect_bus_file_refused(text_of(drives(), "[feet]\nbus = \"can0\"\nunit_n = 0.1\n"), "feet: id is missing");
  expect_bus_file_refused(text_of(drives(), "[feet]\nbus = \"can0\"\nid = 99\nunit_n = 0\n"),
                          "feet: unit_n must be from");
}

TEST(BusFile, WrongCountOfDrives_IsRefused) {
  const auto all = drives();
  expect_bus_file_refused(text_of({all.data(), 11}), "there are 11 [[drive]] tables, and the robot has 12 joints");
}

TEST(BusFile, ClashingIdentifiers_AreRefused) {
  const auto with = [](auto change) {
    auto all = drives();
    change(all);
    return text_of(all);
  };
  expect_bus_file_refused(with([](auto& d) { d[1].id = "1"; }), "left_hip_yaw: id 1 is left_hip_roll's on can0");
  expect_bus_file_refused(with([](auto& d) { d[2].reply_id = "1"; }),
                          "left_hip_pitch: reply_id 1 is the id of left_hip_roll's on can0, too");
  expect_bus_file_refused(with([](auto& d) { d[0].reply_id = "3"; }),
                          "left_hip_pitch: id 3 is the reply_id of left_hip_roll's on can0, too");
  expect_bus_file_refused(with([](auto& d) { d[1].more = "reply = \"status_nibble\"\n"; }),
                          "left_hip_yaw: reply must be as left_hip_roll's on can0, whose reply_id it shares");
  const auto same_on_another_bus = with([](auto& d) { d[3].id = "1"; });
  EXPECT_NO_THROW((void)read_bus(write_bus_file(same_on_another_bus)));
}

TEST(BusFile, LoadAbove60Percent_IsRefused) {
  auto all = drives();
  for (std::size_t n = 0; n < kJointCount; ++n) all[n].bus = n < 4 ? "\"can0\"" : all[n].bus;
  EXPECT_NO_THROW((void)read_bus(write_bus_file(text_of(all)))) << "four drives take 54 %";
  for (std::size_t n = 0; n < kJointCount; ++n) all[n].bus = n < 5 ? "\"can0\"" : all[n].bus;
  expect_bus_file_refused(text_of(all), "the frames of a cycle can take 68 % of can0's time, more than 60 %");
  expect_bus_file_refused("bitrate = 500_000\n" + text_of(drives()), "81 % of can0's time");
}

TEST(BusFile, MissingFileAndFolder_AreRefused) {
  EXPECT_THROW((void)read_bus("/nowhere/bus.toml"), FileError);
  EXPECT_THROW((void)read_bus(testing::TempDir()), FileError);
}

TEST(LimitByDrives, Damiao_LimitsGainsSpeedAndTorque) {
  RobotModel robot;
  limit_by_drives(read_bus(shipped("damiao")), robot);
  const RobotModel before;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    EXPECT_EQ(robot.drives.gain_limits[n].kp_nmprad, 500.0);
    EXPECT_EQ(robot.drives.gain_limits[n].kd_nmsprad, 5.0);
    EXPECT_LE(robot.drives.limits[n].torque_nm, 200.0);
    EXPECT_EQ(robot.drives.limits[n].speed_radps, before.drives.limits[n].speed_radps);
  }
}

TEST(LimitByDrives, DrivesTooWeakForOneLeg_AreRefusedWithWhatTheyLack) {
  RobotModel robot;
  try {
    limit_by_drives(read_bus(shipped("ruiwo")), robot);
    ADD_FAILURE() << "taken";
  } catch (const FileError& error) {
    const std::string sentence = error.what();
    EXPECT_NE(sentence.find("cannot stand on one leg: left_knee needs 86 Nm, and its drive gives 50 Nm."),
              std::string::npos)
        << sentence;
  }
}

TEST(LimitByDrives, DriveThatDoesNotReachItsJoint_IsRefused) {
  auto all = drives();
  all[3].rest = "p = 2\nv = 8\nt = 144\nkp = 500\nkd = 5\n";
  const BusFile bus = read_bus(write_bus_file(text_of(all)));
  RobotModel robot;
  EXPECT_THROW(limit_by_drives(bus, robot), FileError);
}

}  // namespace
}  // namespace polygmap::config
