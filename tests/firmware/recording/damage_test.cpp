// SPDX-License-Identifier: Apache-2.0
// A good recording in which bits, bytes, messages were changed: what a replay says of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "firmware/recording/recording_file.hpp"
#include "firmware/recording/replay.hpp"
#include "tests/firmware/recording/mcap_bytes.hpp"
#include "tests/firmware/recording/recorded_run.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::recording {
namespace {

using mcap_bytes::MessagePlace;
using mcap_bytes::number_at;

// Long enough for every topic of the module's; recorded once.
const Bytes& recording_of_all_topics() {
  static const Bytes bytes = [] {
    const RecordingFolder folder("all_topics");
    RecordedRun run(folder.file());
    run.robot.picture_ticks = 60;
    run.run(1100);
    run.finish();
    return read_file(folder.file());
  }();
  return bytes;
}
const std::vector<MessagePlace>& messages_of_all_topics() {
  static const std::vector<MessagePlace> messages = mcap_bytes::messages_of(recording_of_all_topics());
  return messages;
}
// Whose bytes stand nowhere else in the file.
bool is_read_by_a_replay_alone(const std::string& topic) {
  return topic == "/replay" || topic == "/depth" || topic == "/camera_info";
}

struct Told {
  std::string contradiction, damage, complaint;
};
// Without the module.
Told told_by(Bytes& bytes) {
  RecordingFile file;
  if (file.open("memory", ::fmemopen(bytes.data(), bytes.size(), "rb"))) {
    const auto record = std::make_unique<Record>();
    while (file.read(*record) == RecordingFile::Found::kRecord) {
    }
  }
  return {file.contradiction(), file.damage(), file.complaint()};
}

class DamagedTopic : public testing::Test {
 protected:
  // So many of its messages; never the first few, where nothing happens yet.
  static std::vector<MessagePlace> some_of(const std::string& topic, std::size_t most) {
    std::vector<MessagePlace> all, some;
    std::ranges::copy_if(messages_of_all_topics(), std::back_inserter(all),
                         [&](const MessagePlace& m) { return m.topic == topic; });
    for (std::size_t i = 0; i < std::min(most, all.size()); ++i) some.push_back(all[i * all.size() / most]);
    return some;
  }
  static constexpr std::size_t kMost = test::kSlowMachine ? 1 : 4;
  std::mt19937 random_{11};
};

TEST_F(DamagedTopic, Unchanged_SaysNothingAndHasEveryTopic) {
  Bytes bytes = recording_of_all_topics();
  const Told told = told_by(bytes);
  EXPECT_EQ(told.contradiction + told.damage + told.complaint, "");
  std::set<std::string> topics;
  for (const MessagePlace& message : messages_of_all_topics()) topics.insert(message.topic);
  for (std::size_t i = 0; i < static_cast<std::size_t>(Topic::kTruth); ++i) {
    EXPECT_TRUE(topics.contains(std::string(channels()[i].topic))) << channels()[i].topic;
  }
}

// Somebody edited the file with a tool that mends the chunk's CRC; or the bit was flipped before it was computed.
TEST_F(DamagedTopic, OneBitFlippedAndTheCrcRepaired_TopicIsNamed) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(Topic::kTruth); ++i) {
    const std::string topic(channels()[i].topic);
    if (is_read_by_a_replay_alone(topic)) continue;
    for (const MessagePlace& message : some_of(topic, kMost)) {
      Bytes bytes = recording_of_all_topics();
      const std::size_t byte = mcap::kCdrHead_bytes + random_() % (message.size - mcap::kCdrHead_bytes);
      mcap_bytes::flip_bit(bytes, message.data + byte, random_());
      mcap_bytes::repair_crc(bytes, message.chunk);
      const Told told = told_by(bytes);
      EXPECT_EQ(told.damage, "");
      EXPECT_TRUE(told.contradiction.starts_with("topic " + topic + " at ") ||
                  (topic == "/parameters" && told.complaint.starts_with("\"memory\", byte ")))
          << topic << ", byte " << byte << " of " << message.size << ": " << told.contradiction << told.complaint;
    }
  }
}

TEST_F(DamagedTopic, OneBitFlipped_ChunkIsToldAndTheTopicIsNamedAllTheSame) {
  for (const char* topic : {"/imu", "/joints", "/lio", "/commands", "/map", "/frame"}) {
    for (const MessagePlace& message : some_of(topic, 1)) {
      Bytes bytes = recording_of_all_topics();
      mcap_bytes::flip_bit(bytes, message.data + message.size - 3, random_());
      const Told told = told_by(bytes);
      EXPECT_TRUE(told.contradiction.starts_with(std::string("topic ") + topic + " at ")) << told.contradiction;
      EXPECT_EQ(told.damage, "\"memory\", byte " + std::to_string(message.chunk - 9) +
                                 ": the bytes of this chunk are not those that were written (CRC).");
      EXPECT_EQ(told.complaint, "");
    }
  }
}

TEST_F(DamagedTopic, TimeOfAMessageChanged_TopicIsNamed) {
  for (const char* topic : {"/imu", "/commands", "/surfaces"}) {
    for (const MessagePlace& message : some_of(topic, 1)) {
      for (const std::size_t back : {16U, 8U}) {  // log time, publish time
        Bytes bytes = recording_of_all_topics();
        mcap_bytes::flip_bit(bytes, message.data - back, 1);
        mcap_bytes::repair_crc(bytes, message.chunk);
        EXPECT_NE(told_by(bytes).contradiction.find(std::string("topic ") + topic + " at "), std::string::npos) << back;
      }
    }
  }
}

// Cut out of its chunk, whose lengths and CRC are those of what is left.
Bytes without(const Bytes& file, const MessagePlace& message) {
  Bytes bytes = file;
  const std::size_t size = message.size + 9 + 22;
  for (const std::size_t length_at : {message.chunk - 8, message.chunk + 16, message.chunk + 32}) {
    const std::uint64_t length = number_at<std::uint64_t>(bytes, length_at) - size;
    std::memcpy(bytes.data() + length_at, &length, sizeof length);
  }
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(message.begin);
  bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(size));
  mcap_bytes::repair_crc(bytes, message.chunk);
  return bytes;
}
TEST_F(DamagedTopic, MessageTakenOut_TopicIsNamed) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(Topic::kTruth); ++i) {
    const std::string topic(channels()[i].topic);
    if (is_read_by_a_replay_alone(topic) || topic == "/parameters") continue;
    for (const MessagePlace& message : some_of(topic, 1)) {
      Bytes bytes = without(recording_of_all_topics(), message);
      const Told told = told_by(bytes);
      EXPECT_EQ(told.damage + told.complaint, "");
      EXPECT_TRUE(told.contradiction.starts_with("topic " + topic + " at ")) << topic << ": " << told.contradiction;
    }
  }
}

// A recording of few ticks, which a replay lives in no time.
class ShortRecording : public testing::Test {
 protected:
  ShortRecording() {
    Params params;
    params.estimator.rest_ns = 0;  // the joints are read for something from the first tick on
    RecordedRun run(folder_.file(), params);
    run.run(kTicks);
    run.finish();
    bytes_ = read_file(folder_.file());
    messages_ = mcap_bytes::messages_of(bytes_);
  }
  [[nodiscard]] const MessagePlace& first(const std::string& topic) const {
    return *std::ranges::find(messages_, topic, &MessagePlace::topic);
  }
  // Where the n-th call of that row has its first port call, in /replay.
  [[nodiscard]] std::size_t first_call(std::uint8_t row, int n) const {
    for (int found = -1; const MessagePlace& message : messages_) {
      if (message.topic != "/replay") continue;
      for (std::size_t at = message.data + 8; at < message.data + message.size;) {
        if (bytes_[at] == std::byte{'R'} && bytes_[at + 5] == std::byte{row} && ++found == n) {
          return at + 5 + 1 + 8 + 4 + 1 + 4 + 2;
        }
        at += 5 + number_at<std::uint32_t>(bytes_, at + 1);
      }
    }
    return 0;
  }
  [[nodiscard]] std::size_t chunk_of(std::size_t byte) const {
    std::size_t chunk = 0;
    for (const MessagePlace& message : messages_) chunk = message.begin <= byte ? message.chunk : chunk;
    return chunk;
  }
  [[nodiscard]] ReplayResult replay_of(const Bytes& bytes) const {
    write_file(folder_.file(), bytes);
    return replay(folder_.file());
  }
  [[nodiscard]] ReplayResult replay_repaired(Bytes bytes, std::size_t changed) const {
    mcap_bytes::repair_crc(bytes, chunk_of(changed));
    return replay_of(bytes);
  }
  static void expect_unreadable(const ReplayResult& result, const std::string& words) {
    EXPECT_EQ(result.verdict, ReplayVerdict::kUnreadable);
    EXPECT_NE(result.complaint.find(words), std::string::npos) << result.complaint;
    EXPECT_EQ(result.complaint.find('\n'), std::string::npos);
    EXPECT_TRUE(result.complaint.ends_with('.')) << result.complaint;
  }

  static constexpr int kTicks = 40;  // with a picture, which nobody can place yet
  const RecordingFolder folder_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  Bytes bytes_;
  std::vector<MessagePlace> messages_;
};

TEST_F(ShortRecording, Unchanged_Replays) { expect_same(folder_.file(), kTicks); }

TEST_F(ShortRecording, OneBitOfAnInputFlipped_TickStageAndFieldAreNamed) {
  for (const unsigned bit : {0U, 20U, 51U, 63U}) {
    Bytes flipped = bytes_;
    const std::size_t knee = first_call(0, 30) + (2 + 56) + 2 + (2 + 8 + 3 * 8);  // the IMU's sample, no other, joints
    mcap_bytes::flip_bit(flipped, knee + bit / 8, bit);
    const ReplayResult result = replay_repaired(flipped, knee);
    EXPECT_EQ(result.verdict, ReplayVerdict::kDiffers) << bit << text_of(result);
    EXPECT_GT(result.differ, 0U);
    EXPECT_EQ(result.ticks, static_cast<std::uint64_t>(kTicks));
    EXPECT_EQ(result.difference.find("tick 30, estimate, "), 0U) << result.difference;
    EXPECT_NE(result.difference.find(": recorded 0x"), std::string::npos) << result.difference;
  }
}

TEST_F(ShortRecording, OneBitOfACommandFlipped_CallAndFieldAreNamed) {
  Bytes flipped = bytes_;
  const std::size_t call = first_call(static_cast<std::uint8_t>(row_of("command")), 30);
  ASSERT_EQ(flipped[call], static_cast<std::byte>(CallKind::kWriteJoints));
  const std::size_t knee_kp = call + 2 + 2 + 8 + (3 * 5 + 3) * 8;
  mcap_bytes::flip_bit(flipped, knee_kp + 5, 3);
  const ReplayResult result = replay_repaired(flipped, knee_kp);
  EXPECT_EQ(result.verdict, ReplayVerdict::kDiffers);
  EXPECT_EQ(result.differ, 1U);
  EXPECT_EQ(result.difference.find("tick 30, command, joints.try_write.joints[3].kp_nmprad: recorded 0x"), 0U)
      << result.difference;
}

TEST(FieldComparer, HealthThatCountedMore_NamesTheFault) {
  Health recorded, computed;
  recorded.raise(Fault::kDriveError, 10);
  computed.raise(Fault::kDriveError, 10, 2);
  std::vector<std::byte> memory(64U * 1024U);
  ByteWriter out(memory);
  std::uint32_t never = recorded.raised() - 1;
  {
    FieldWriter writer(out, &never);
    writer.health(recorded);
  }
  for (const Health* health : {&recorded, &computed}) {
    HealthCounts last{};
    ByteReader in(out.bytes());
    FieldComparer comparer(in, &last);
    comparer.health(*health);
    const bool same = health == &recorded;
    EXPECT_EQ(comparer.difference().empty(), same) << comparer.difference();
    if (!same) {
      EXPECT_EQ(comparer.difference().find("drive_error.count: recorded 0x1 (1), computed 0x2 (2)"), 0U);
    }
  }
}

// What the module computes is the same, and the file says something else of it.
TEST_F(ShortRecording, OneBitOfATopicFlipped_DiffersThoughNoTickDoes) {
  for (const char* topic : {"/imu", "/joints", "/feet", "/commands", "/odometry", "/camera_info"}) {
    Bytes flipped = bytes_;
    const MessagePlace& message = first(topic);
    mcap_bytes::flip_bit(flipped, message.data + message.size - 2, 4);
    const ReplayResult result = replay_repaired(flipped, message.data);
    EXPECT_EQ(result.verdict, ReplayVerdict::kDiffers) << topic;
    EXPECT_EQ(result.differ, 0U);
    EXPECT_TRUE(text_of(result).starts_with(std::string("first difference: topic ") + topic + " at "))
        << text_of(result);
  }
}

// Every bit of a frame's exact record is held by something: an output, a topic, its own form. Some are of what nothing
// computes with; those are few.
TEST_F(ShortRecording, AnyBitOfReplayFlipped_IsHardlyEverMissed) {
  std::mt19937 random(5);
  constexpr int kFlips = test::kSlowMachine ? 20 : 400;
  int missed = 0;
  for (int i = 0; i < kFlips; ++i) {
    std::vector<MessagePlace> frames;
    std::ranges::copy_if(messages_, std::back_inserter(frames), [](const auto& m) { return m.topic == "/replay"; });
    const MessagePlace& frame = frames[random() % frames.size()];
    const std::size_t byte = frame.data + random() % frame.size;
    Bytes flipped = bytes_;
    mcap_bytes::flip_bit(flipped, byte, random());
    missed += replay_repaired(flipped, byte).verdict == ReplayVerdict::kSame ? 1 : 0;
  }
  EXPECT_LE(missed, kFlips / 10);
  RecordProperty("missed", missed);
}

TEST_F(ShortRecording, SampleThatNeverCame_IsAnotherOrderOfCallsOrAnotherResult) {
  Bytes changed = bytes_;
  const std::size_t call = first_call(0, 20);
  changed[call] = std::byte{2};  // the IMU's sample is said to be the joints', which is longer
  EXPECT_NE(replay_repaired(changed, call).verdict, ReplayVerdict::kSame);
}

TEST_F(ShortRecording, PixelChanged_PictureIsNotTheRecordedOne) {
  const MessagePlace& picture = first("/depth");
  ASSERT_GT(picture.size, 600'000U);
  Bytes changed = bytes_;
  mcap_bytes::flip_bit(changed, picture.data + 300'001, 2);
  ReplayResult result = replay_repaired(changed, picture.data);
  expect_unreadable(result, "picture 0 of /depth is not the one that was recorded");
  EXPECT_NE(result.complaint.find("byte "), std::string::npos);
  result = replay_of(without(bytes_, picture));
  expect_unreadable(result, "picture 0 of /depth is missing");
}

TEST(Replay, WhatIsNoRecording_IsOneSentence) {
  const RecordingFolder folder("none");
  const auto expect_none = [&](const std::string& path, const std::string& why) {
    const ReplayResult result = replay(path);
    EXPECT_EQ(result.verdict, ReplayVerdict::kUnreadable);
    EXPECT_EQ(result.complaint, "\"" + path + "\" is no recording: " + why);
  };
  expect_none("/there/is/none", "there is no such file.");
  expect_none("/dev/null", "it is no plain file.");
  expect_none(folder.path().string(), "it is a directory, and a recording is a file (run.mcap).");
  write_file(folder.file(), {});
  expect_none(folder.file(), "it is empty.");
  write_file(folder.file(), Bytes(1));
  expect_none(folder.file(), "it does not begin as an MCAP file does.");
  write_file(folder.file(), Bytes(100'000));
  expect_none(folder.file(), "it does not begin as an MCAP file does.");
}

TEST_F(ShortRecording, McapOfSomebodyElse_HasNoParameters) {
  Bytes foreign = bytes_;
  for (const mcap::Channel& channel : channels()) {
    const std::string topic(channel.topic);
    for (auto at = foreign.begin();
         (at = std::search(at, foreign.end(), topic.begin(), topic.end(),
                           [](std::byte a, char b) { return a == static_cast<std::byte>(b); })) != foreign.end();) {
      at[1] = std::byte{'x'};
    }
  }
  expect_unreadable(replay_of(foreign),
                    "\" is no recording of this module: it has no topic /parameters before it ends.");
}

TEST_F(ShortRecording, AnotherVersionOrBuild_IsSaid) {
  const auto at = std::search(bytes_.begin(), bytes_.end(), kMagic.begin(), kMagic.end(),
                              [](std::byte a, char b) { return a == static_cast<std::byte>(b); });
  ASSERT_NE(at, bytes_.end());
  const auto magic = static_cast<std::size_t>(at - bytes_.begin());
  Bytes changed = bytes_;
  changed[magic + 8] = std::byte{9};
  expect_unreadable(replay_repaired(changed, magic), "version 9, where this program reads " + std::to_string(kVersion));
  changed = bytes_;
  mcap_bytes::flip_bit(changed, magic + 12, 0);
  expect_unreadable(replay_repaired(changed, magic), "it has the fields of another build");
}

TEST_F(ShortRecording, ParameterUnknownOutOfRangeOrWithAnotherText_IsNamed) {
  const std::string name = "tread_height_sigma_m";
  const auto place_after = [&](std::size_t from) {
    const auto at = std::search(bytes_.begin() + static_cast<std::ptrdiff_t>(from), bytes_.end(), name.begin(),
                                name.end(), [](std::byte a, char b) { return a == static_cast<std::byte>(b); });
    return static_cast<std::size_t>(at - bytes_.begin());
  };
  const std::size_t text = place_after(0), header = place_after(text + 1);  // the texts come first
  ASSERT_LT(header, bytes_.size());
  Bytes changed = bytes_;
  changed[header] = std::byte{'x'};
  expect_unreadable(replay_repaired(changed, header), "this module has no parameter \"xread_height_sigma_m\"");
  changed = bytes_;
  const double wide = 0.2;
  std::memcpy(&changed[header + name.size() + 5], &wide, sizeof wide);
  expect_unreadable(replay_repaired(changed, header), "parameter \"tread_height_sigma_m\" is outside its range");
  changed = bytes_;
  changed[text] = std::byte{'x'};
  const ReplayResult result = replay_repaired(changed, text);
  EXPECT_EQ(result.verdict, ReplayVerdict::kDiffers);
  EXPECT_TRUE(result.difference.starts_with("topic /parameters at ")) << result.difference;
}

TEST_F(ShortRecording, CutOffAnywhere_IsUnfinishedAndNothingDiffers) {
  std::mt19937 random(2);
  const std::size_t begun = first("/parameters").data + first("/parameters").size;
  for (int i = 0; i < (test::kSlowMachine ? 20 : 200); ++i) {
    const std::size_t size = i == 0 ? bytes_.size() - 9 : random() % (bytes_.size() - 9);
    const ReplayResult result = replay_of(Bytes(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_EQ(result.differ, 0U);
    EXPECT_TRUE(result.difference.empty()) << result.difference;
    if (size < begun) {
      expect_unreadable(result, " is no recording");
    } else if (result.verdict == ReplayVerdict::kUnreadable) {  // before the first chunk's end
      expect_unreadable(result, "it has no topic /parameters");
    } else if (result.ticks < kTicks) {
      EXPECT_EQ(result.verdict, ReplayVerdict::kUnfinished) << size << text_of(result);
      EXPECT_NE(text_of(result).find("The recording is unfinished: it was cut off.\n"), std::string::npos);
    }
  }
}

// Bits flipped, bytes set, pieces doubled, moved and cut out: the same, another result or one sentence, and no crash.
TEST_F(ShortRecording, ThousandsOfMutations_EndInAVerdict) {
  constexpr int kMutations = test::kSlowMachine ? 100 : 1000;
  std::mt19937 random(3);
  std::array<int, 4> verdicts{};
  for (int i = 0; i < kMutations; ++i) {
    Bytes changed = bytes_;
    const auto place = [&] {
      return random() % (i % 3 == 0 ? std::min<std::size_t>(changed.size(), 100'000) : changed.size());
    };
    for (unsigned change = 0; change <= random() % 3; ++change) {
      const auto at = static_cast<std::ptrdiff_t>(place());
      const std::ptrdiff_t length =
          std::min<std::ptrdiff_t>(1 + random() % 64, static_cast<std::ptrdiff_t>(changed.size()) - at);
      switch (random() % 6) {
        case 0:
        case 1:
          mcap_bytes::flip_bit(changed, static_cast<std::size_t>(at), random());
          break;
        case 2:
          std::fill_n(changed.begin() + at, length, random() % 2 == 0 ? std::byte{0xFF} : std::byte{0x7F});
          break;
        case 3: {
          const Bytes piece(changed.begin() + at, changed.begin() + at + length);
          changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(place()), piece.begin(), piece.end());
          break;
        }
        case 4:
          changed.erase(changed.begin() + at, changed.begin() + at + length);
          break;
        default:
          for (std::ptrdiff_t k = at; k < at + length; ++k)
            changed[static_cast<std::size_t>(k)] = static_cast<std::byte>(random());
      }
    }
    if (random() % 2 == 0) {
      for (const auto& record : mcap_bytes::records_of(changed)) {
        const bool is_chunk = record.opcode == mcap_bytes::kChunk && record.size > mcap_bytes::kChunkRecords;
        const bool fits = is_chunk && number_at<std::uint64_t>(changed, record.content + 32) <= record.size - 40;
        if (fits) mcap_bytes::repair_crc(changed, record.content);
      }
    }
    const ReplayResult result = replay_of(changed);
    ++verdicts[static_cast<std::size_t>(result.verdict)];
    if (result.verdict == ReplayVerdict::kUnreadable) expect_unreadable(result, ".");
    if (result.verdict == ReplayVerdict::kSame || result.verdict == ReplayVerdict::kUnfinished) {
      EXPECT_EQ(result.difference, "");
    }
  }
  // Some change the index, which a replay does not read: those are the same.
  for (const ReplayVerdict verdict : {ReplayVerdict::kSame, ReplayVerdict::kDiffers, ReplayVerdict::kUnreadable}) {
    EXPECT_GT(verdicts[static_cast<std::size_t>(verdict)], 0) << static_cast<int>(verdict);
  }
}

}  // namespace
}  // namespace polygmap::recording
