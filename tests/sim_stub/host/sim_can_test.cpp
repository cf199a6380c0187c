// SPDX-License-Identifier: Apache-2.0
// `polygmap can`: frames made and read, and a DBC that another program reads as we do.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "firmware/config/bus_file.hpp"
#include "sim_stub/bus/candump_log.hpp"
#include "sim_stub/host/can/can_text.hpp"
#include "sim_stub/host/cli/climb_command.hpp"

namespace polygmap::sim {
namespace {

std::string shipped(const std::string& name) { return std::string(POLYGMAP_BUSES) + "/" + name + ".toml"; }

struct Said {
  int code;
  std::string out, err;
};
Said say(std::vector<std::string> words) {
  std::ostringstream out, err;
  const auto never = [](const ClimbOptions&, const ClimbProgressFunction&) -> ClimbSummary { return {}; };
  const int code = polygmap_main(words, never, out, err, false);
  return {code, out.str(), err.str()};
}

TEST(Can, Encode_PrintsTheFrameAndDecodeReadsIt) {
  const Said sent = say({"can", "encode", "--bus", shipped("cubemars"), "--joint", "3", "--q", "0.5", "--dq", "-1",
                         "--kp", "300", "--kd", "2.5", "--tau", "-10"});
  ASSERT_EQ(sent.code, kExitPass) << sent.err;
  const std::string frame = sent.out.substr(0, sent.out.size() - 1);
  EXPECT_EQ(frame.substr(0, 4), "004#");
  EXPECT_EQ(frame.size(), 20U);
  EXPECT_EQ(say({"can", "encode", "--bus", shipped("cubemars"), "--joint", "left_knee", "--q", "0.5", "--dq", "-1",
                 "--kp", "300", "--kd", "2.5", "--tau", "-10"})
                .out,
            sent.out);
  const Said got = say({"can", "decode", "--bus", shipped("cubemars"), frame});
  ASSERT_EQ(got.code, kExitPass) << got.err;
  const auto json = nlohmann::json::parse(got.out);
  ASSERT_EQ(json["readings"].size(), 1U);
  const auto& reading = json["readings"][0];
  EXPECT_EQ(reading["joint"], "left_knee");
  EXPECT_EQ(reading["bus"], "can1");
  EXPECT_EQ(reading["kind"], "command");
  EXPECT_NEAR(reading["q_rad"].get<double>(), 0.5, 2e-4);
  EXPECT_NEAR(reading["dq_radps"].get<double>(), -1.0, 2e-3);
  EXPECT_NEAR(reading["kp_nmprad"].get<double>(), 300.0, 0.07);
  EXPECT_NEAR(reading["kd_nmsprad"].get<double>(), 2.5, 7e-4);
  EXPECT_NEAR(reading["tau_nm"].get<double>(), -10.0, 0.04);
}

TEST(Can, Decode_KnowsRepliesSpecialFramesAndFeet) {
  const auto read = [](const std::string& frame) {
    const Said said = say({"can", "decode", "--bus", shipped("damiao"), frame});
    EXPECT_EQ(said.code, kExitPass) << said.err;
    return nlohmann::json::parse(said.out)["readings"][0];
  };
  EXPECT_EQ(read("005#FFFFFFFFFFFFFFFC")["special"], "enter");
  const auto reply = read("015#95FFFF000FFF2122");
  EXPECT_EQ(reply["joint"], "left_ankle_pitch");
  EXPECT_EQ(reply["kind"], "reply");
  EXPECT_EQ(reply["q_rad"], 12.5);
  EXPECT_EQ(reply["dq_radps"], -25.0);
  EXPECT_EQ(reply["tau_nm"], 200.0);
  EXPECT_EQ(reply["status"], 9);
  EXPECT_EQ(reply["drive_error"], true);
  EXPECT_EQ(reply["mos_degc"], 0x21);
  EXPECT_EQ(reply["motor_degc"], 0x22);
  EXPECT_FALSE(read("015#95FFFF000FFF").contains("motor_degc")) << "a short reply tells none";
  EXPECT_EQ(read("060#00641000")["left_n"], 5.0);
}

TEST(Can, BadWords_AreRefusedInOneSentence) {
  const auto refused = [](std::vector<std::string> words, const std::string& what) {
    const Said said = say(std::move(words));
    EXPECT_EQ(said.code, kExitUsage);
    EXPECT_NE(said.err.find(what), std::string::npos) << said.err;
    EXPECT_EQ(std::count(said.err.begin(), said.err.end(), '\n'), 1) << said.err;
    EXPECT_TRUE(said.out.empty());
  };
  const std::string bus = shipped("damiao");
  refused({"can", "encode", "--bus", bus, "--joint", "12"}, "--joint must be a number from 0 to 11");
  refused({"can", "encode", "--bus", bus, "--joint", "knee"}, "--joint must be");
  refused({"can", "encode", "--bus", bus, "--joint", "1", "--q", "inf"}, "--q must be a finite number in the range of");
  refused({"can", "encode", "--bus", bus, "--joint", "1", "--kd", "nan"}, "--kd must be a finite number");
  refused({"can", "encode", "--bus", bus, "--joint", "1", "--kd", "x"},
          "\"x\" is no number that --kd can take; see polygmap can encode --help.");
  refused({"can", "encode", "--bus", "/nowhere.toml", "--joint", "1"}, "Cannot read the bus file");
  for (const char* frame : {"1", "#11", "800#11", "001#1", "001#112233445566778899", "0011#11", "00G#11", "001#1G"}) {
    refused({"can", "decode", "--bus", bus, frame}, "A frame is an identifier");
  }
  refused({"can", "decode", "--bus", bus, "123#11"}, "\" sends or takes frames under 123.\n");
  refused({"can", "decode", "--bus", bus, "--on", "can0", "004#11"}, "Nothing on can0 of bus file \"");
  refused({"can", "dbc", "--bus", bus, "--on", "can7"}, "has no bus \"can7\"");
}

TEST(Can, EncodeBeyondTheRange_SaysSo) {
  const Said said = say({"can", "encode", "--bus", shipped("ruiwo"), "--joint", "0", "--kp", "300", "--q", "13"});
  EXPECT_EQ(said.code, kExitPass);
  EXPECT_EQ(said.err,
            "polygmap: warning: --q 13 is beyond the range of left_hip_roll's drive, -12.5 to 12.5 rad: the frame has "
            "12.5.\n"
            "polygmap: warning: --kp 300 is beyond the range of left_hip_roll's drive, 0 to 250 Nm/rad: the frame has "
            "250.\n");
  const Said decoded = say({"can", "decode", "--bus", shipped("ruiwo"), said.out.substr(0, said.out.size() - 1)});
  EXPECT_EQ(nlohmann::json::parse(decoded.out)["readings"][0]["kp_nmprad"], 250.0);
}

TEST(Can, FrameOfAnotherLength_IsASentenceAndNoJson) {
  for (const auto& [frame, sentence] :
       {std::pair{"001#",
                  "polygmap: 001# has 0 bytes, but it would be a command to left_hip_roll on can0, and a command "
                  "has 8 bytes.\n"},
        {"001#11",
         "polygmap: 001#11 has 1 byte, but it would be a command to left_hip_roll on can0, and a command has 8 "
         "bytes.\n"},
        {"015#95FFFF",
         "polygmap: 015#95FFFF has 3 bytes, but it would be a reply of left_ankle_pitch on can1, and a "
         "reply has 6 or 8 bytes.\n"},
        {"060#00",
         "polygmap: 060#00 has 1 byte, but it would be the feet's on can0, and the feet's frame has 4 "
         "bytes.\n"}}) {
    const Said said = say({"can", "decode", "--bus", shipped("damiao"), frame});
    EXPECT_EQ(said.code, kExitUsage) << frame;
    EXPECT_EQ(said.out, "") << frame;
    EXPECT_EQ(said.err, sentence);
  }
}

// Of each shipped file what is true of it: 014 is the identifier of a reply, or of nothing; 000 of all replies, or of
// nothing.
TEST(Can, FrameOfNoDrive_SaysWhatTheIdentifierIs) {
  const auto refused = [](const std::string& bus, const std::string& frame, const std::string& what) {
    const Said said = say({"can", "decode", "--bus", shipped(bus), frame});
    EXPECT_EQ(said.code, kExitUsage) << frame;
    EXPECT_EQ(said.out, "") << frame;
    EXPECT_NE(said.err.find(what), std::string::npos) << said.err;
  };
  refused("damiao", "014#00",
          "014#00 has 1 byte, but under 014 left_knee on can1 replies, and a reply has 6 or 8 bytes.");
  refused("damiao", "014#", "014# has 0 bytes, but under 014 left_knee on can1 replies");
  refused("damiao", "014#057FFF7FF7FF",
          "014#057FFF7FF7FF names drive 5 in its first byte, but under 014 left_knee on can1 replies, as drive 4.");
  refused("damiao", "000#00", "sends or takes frames under 000.");
  for (const char* bus : {"cubemars", "ruiwo"}) {
    refused(bus, "014#00", "sends or takes frames under 014.");
    refused(bus, "000#00", "000#00 has 1 byte, but under 000 12 drives reply, and a reply has 6 or 8 bytes.");
    refused(bus, "000#147FFF7FF7FF",
            "000#147FFF7FF7FF names drive 20 in its first byte, but under 000 12 drives reply, none as that.");
  }
}

// A command on one bus has the identifier of a reply on another: what the bytes fit is read, and the other one is told.
TEST(Can, FrameThatFitsOneOfTwoReadings_IsThatOneWithAWarning) {
  std::ifstream file(shipped("damiao"));
  std::string text((std::istreambuf_iterator<char>(file)), {});
  for (std::size_t at = 0; (at = text.find("reply_id = 0x15", at)) != std::string::npos;)
    text.replace(at, 15, "reply_id = 1");
  const std::string path = testing::TempDir() + "polygmap_command_and_reply.toml";
  std::ofstream(path) << text;
  const Said said = say({"can", "decode", "--bus", path, "001#95FFFF000FFF"});
  ASSERT_EQ(said.code, kExitPass) << said.err;
  const auto readings = nlohmann::json::parse(said.out)["readings"];
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_EQ(readings[0]["kind"], "reply");
  EXPECT_EQ(readings[0]["joint"], "left_ankle_pitch");
  EXPECT_EQ(
      said.err,
      "polygmap: warning: 001#95FFFF000FFF has 6 bytes, but it would be a command to left_hip_roll on can0, and a "
      "command has 8 bytes.\n");
}

// Each random frame, read by canmatrix through our DBC and by our codec: the same signals at the same bits and scales.
class DbcTest : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(, DbcTest, testing::Values("cubemars", "damiao", "ruiwo"));

TEST_P(DbcTest, Canmatrix_ReadsEveryFrameAsTheCodecDoes) {
  if (std::system("/usr/bin/python3 -c 'import canmatrix' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3-canmatrix is not installed: the DBC is not compared with another reader";
  }
  const config::BusFile bus = config::read_bus(shipped(GetParam()));
  const std::string base = testing::TempDir() + "polygmap_dbc_" + GetParam();
  std::ofstream(base + ".dbc") << dbc_text(bus, "");

  std::mt19937_64 random(1);
  std::vector<hal::CanFrame> frames;
  for (int i = 0; i < 60; ++i) {
    const std::size_t n = static_cast<std::size_t>(i) % kJointCount;
    const hal::CanDrive& drive = bus.table.drives[n];
    hal::CanFrame frame;
    frame.length = 8;
    for (std::size_t k = 0; k < 8; ++k) frame.data[k] = static_cast<std::uint8_t>(random());
    frame.id = drive.id;
    frames.push_back(frame);
    frame.id = drive.reply_id;
    const bool nibble = drive.reply == hal::MitReplyRule::kStatusNibble;
    frame.data[0] = static_cast<std::uint8_t>(nibble ? (frame.data[0] & 0xF0U) | drive.id : drive.id);
    frames.push_back(frame);
    frame.id = bus.table.feet.id;
    frame.length = 4;
    frames.push_back(frame);
  }
  std::ofstream list(base + ".frames");
  for (const hal::CanFrame& frame : frames) list << frame_text(frame) << "\n";
  list.close();
  const std::string command = "/usr/bin/python3 " + std::string(POLYGMAP_TESTS_SUPPORT) + "/dbc_decode.py " + base +
                              ".dbc < " + base + ".frames > " + base + ".out";
  ASSERT_EQ(std::system(command.c_str()), 0);

  std::ifstream answers(base + ".out");
  std::string line;
  std::size_t compared = 0;
  for (const hal::CanFrame& frame : frames) {
    ASSERT_TRUE(std::getline(answers, line));
    std::istringstream words(line);
    std::string name, signal;
    double value = 0.0;
    words >> name;
    std::map<std::string, double> theirs;
    while (words >> signal >> value) {
      for (const std::string_view joint : kJointNames) {
        if (signal.starts_with(std::string(joint) + "_")) signal = signal.substr(joint.size() + 1);
      }
      theirs[signal] = value;
    }
    const auto reading = nlohmann::json::parse(frame_reading(bus, "", frame).json)["readings"][0];
    for (const auto& [theirs_name, ours_name] : {std::pair{"position", "q_rad"},
                                                 {"velocity", "dq_radps"},
                                                 {"kp", "kp_nmprad"},
                                                 {"kd", "kd_nmsprad"},
                                                 {"torque", "tau_nm"},
                                                 {"status", "status"},
                                                 {"mos_temperature", "mos_degc"},
                                                 {"motor_temperature", "motor_degc"},
                                                 {"left_force", "left_n"},
                                                 {"right_force", "right_n"}}) {
      if (!theirs.contains(theirs_name)) continue;
      ASSERT_TRUE(reading.contains(ours_name)) << line;
      EXPECT_NEAR(theirs[theirs_name], reading[ours_name].get<double>(), 1e-9) << line;
      ++compared;
    }
  }
  EXPECT_GE(compared, 60U * (5 + 3 + 1 + 2));
}

TEST(Dbc, IdentifierOfTwoBuses_NeedsOneNamed) {
  std::ifstream file(shipped("cubemars"));
  std::string text((std::istreambuf_iterator<char>(file)), {});
  text.replace(text.find("id = 4\n"), 7, "id = 1\n");
  const std::string path = testing::TempDir() + "polygmap_two_ones.toml";
  std::ofstream(path) << text;
  const config::BusFile bus = config::read_bus(path);
  EXPECT_THROW((void)dbc_text(bus, ""), config::FileError);
  EXPECT_NE(dbc_text(bus, "can1").find("BO_ 1 left_knee_command: 8"), std::string::npos);
}

}  // namespace
}  // namespace polygmap::sim
