// SPDX-License-Identifier: Apache-2.0
// What McapWriter writes: read back by McapReader, and looked at byte by byte where the specification says what is to
// be where.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "firmware/recording/mcap/mcap_reader.hpp"
#include "firmware/recording/mcap/mcap_writer.hpp"
#include "sim_stub/heap_trap.hpp"
#include "tests/firmware/recording/mcap_bytes.hpp"
#include "tests/firmware/recording/recorded_run.hpp"

namespace polygmap::mcap {
namespace {

using mcap_bytes::number_at;
using mcap_bytes::RecordPlace;
using recording::Bytes;
using recording::read_file;
using recording::RecordingFolder;
using recording::write_file;

constexpr std::array<Channel, 3> kChannels{Channel{"/a", "test_msgs/msg/A", "uint8 a"},
                                           {"/b", "test_msgs/msg/B", "uint8 b"},
                                           {"/c", "test_msgs/msg/A", "uint8 a"}};

struct Message {
  std::size_t channel = 0;
  std::int64_t log_ns = 0, publish_ns = 0;
  Bytes data;
  bool alone = false;
};
Bytes random_bytes(std::mt19937& random, std::size_t size) {
  Bytes bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

class McapFile : public testing::Test {
 protected:
  void write(const std::vector<Message>& messages) {
    const heap::ModuleCall call("McapWriter");
    ASSERT_TRUE(writer_->open(path_, kChannels, 42));
    for (const Message& m : messages) {
      const std::span<const std::byte> data = m.data;
      const std::size_t head = std::min<std::size_t>(10, data.size());
      ASSERT_TRUE(m.alone
                      ? writer_->write_alone(m.channel, m.log_ns, m.publish_ns, data.first(head), data.subspan(head))
                      : writer_->write(m.channel, m.log_ns, m.publish_ns, data));
    }
    ASSERT_TRUE(writer_->close());
  }
  void expect_reads(const std::string& path, std::span<const Message> messages, McapReader::Found end) {
    McapReader reader;
    ASSERT_TRUE(reader.open(path)) << reader.complaint();
    std::array<std::uint32_t, kChannels.size()> sequences{};
    MessageRead read;
    for (const Message& m : messages) {
      ASSERT_EQ(reader.next(read), McapReader::Found::kMessage) << reader.complaint();
      ASSERT_EQ(reader.channels()[read.channel].topic, kChannels[m.channel].topic);
      ASSERT_EQ(reader.channels()[read.channel].schema, kChannels[m.channel].schema_name);
      ASSERT_EQ(reader.channels()[read.channel].encoding, "cdr");
      ASSERT_EQ(read.log_ns, m.log_ns);
      ASSERT_EQ(read.publish_ns, m.publish_ns);
      ASSERT_TRUE(std::ranges::equal(read.data, m.data));
      ASSERT_EQ(read.sequence, sequences[m.channel]++);
    }
    EXPECT_EQ(reader.next(read), end) << reader.complaint();
    EXPECT_FALSE(reader.is_damaged()) << reader.damage();
    EXPECT_EQ(reader.run(), "000000000000002a");
  }

  const RecordingFolder folder_{"mcap"};
  const std::string path_ = folder_.file();
  const std::unique_ptr<McapWriter> writer_ = std::make_unique<McapWriter>();
};

std::vector<Message> some_messages(int count) {
  std::mt19937 random(3);
  std::vector<Message> messages;
  std::int64_t t_ns = 5'000'000'000;
  for (int i = 0; i < count; ++i) {
    t_ns += static_cast<std::int64_t>(random() % 20'000'000);
    const bool alone = random() % 40 == 0;
    const std::size_t size = alone ? 700'000 : random() % 30 == 0 ? 100'000 : random() % 300;
    messages.push_back({random() % kChannels.size(), t_ns, t_ns - 3, random_bytes(random, size), alone});
  }
  return messages;
}

TEST_F(McapFile, MessagesOfAllSizes_ComeBack) {
  const std::vector<Message> messages = some_messages(2000);
  write(messages);
  expect_reads(path_, messages, McapReader::Found::kEnd);
}

TEST_F(McapFile, WithoutMessages_IsAFileAllTheSame) {
  write({});
  expect_reads(path_, {}, McapReader::Found::kEnd);
}

TEST_F(McapFile, Chunks_AreClosedByTimeAndBySize) {
  std::vector<Message> messages;
  for (int i = 0; i < 1000; ++i) messages.push_back({0, 10'000'000LL * i, 0, Bytes(8)});  // 100 Hz, ten seconds
  for (int i = 0; i < 20; ++i) messages.push_back({0, 10'000'000'000LL, 0, Bytes(100'000)});
  write(messages);
  const Bytes file = read_file(path_);
  int chunks = 0, large = 0;
  for (const RecordPlace& record : mcap_bytes::records_of(file)) {
    if (record.opcode != mcap_bytes::kChunk) continue;
    ++chunks;
    const auto first_ns = number_at<std::int64_t>(file, record.content);
    const auto last_ns = number_at<std::int64_t>(file, record.content + 8);
    EXPECT_LT(last_ns - first_ns, McapWriter::kChunk_ns);
    EXPECT_LE(record.size, mcap_bytes::kChunkRecords + McapWriter::kChunk_bytes);
    large += record.size > 300'000 ? 1 : 0;
  }
  EXPECT_EQ(chunks, 25 + 5);
  EXPECT_EQ(large, 5);
}

// What a reader with an index needs: from the footer to each chunk, and in it to each message.
TEST_F(McapFile, Index_LeadsToEveryMessage) {
  const std::vector<Message> messages = some_messages(500);
  write(messages);
  const Bytes file = read_file(path_);
  const std::vector<RecordPlace> records = mcap_bytes::records_of(file);
  const RecordPlace& footer = records.back();
  ASSERT_EQ(footer.opcode, mcap_bytes::kFooter);
  ASSERT_EQ(footer.content + footer.size + 8, file.size()) << "the magic follows it";
  const auto summary = number_at<std::uint64_t>(file, footer.content);
  const std::span<const std::byte> all = file;
  EXPECT_EQ(number_at<std::uint32_t>(file, footer.content + 16),
            Crc32::of(all.subspan(summary, footer.content + 16 - summary)));
  const auto data_end = std::ranges::find(records, std::uint8_t{mcap_bytes::kDataEnd}, &RecordPlace::opcode);
  EXPECT_EQ(number_at<std::uint32_t>(file, data_end->content), Crc32::of(all.first(data_end->begin)));

  std::size_t chunks = 0, indexed = 0;
  for (const RecordPlace& entry : mcap_bytes::records_of(all, summary)) {
    if (entry.opcode == mcap_bytes::kStatistics) {
      EXPECT_EQ(number_at<std::uint64_t>(file, entry.content), messages.size());
      EXPECT_EQ(number_at<std::uint16_t>(file, entry.content + 8), 2U) << "schemas";
      EXPECT_EQ(number_at<std::uint32_t>(file, entry.content + 10), 3U) << "channels";
      EXPECT_EQ(number_at<std::int64_t>(file, entry.content + 26), messages.front().log_ns);
      EXPECT_EQ(number_at<std::int64_t>(file, entry.content + 34), messages.back().log_ns);
    }
    if (entry.opcode != mcap_bytes::kChunkIndex) continue;
    ++chunks;
    const auto begin = number_at<std::uint64_t>(file, entry.content + 16);
    const auto chunk = std::ranges::find(records, begin, &RecordPlace::begin);
    ASSERT_NE(chunk, records.end());
    ASSERT_EQ(chunk->opcode, mcap_bytes::kChunk);
    EXPECT_EQ(number_at<std::uint64_t>(file, entry.content + 24), 9 + chunk->size);
    EXPECT_EQ(number_at<std::int64_t>(file, entry.content), number_at<std::int64_t>(file, chunk->content));
    const auto map_bytes = number_at<std::uint32_t>(file, entry.content + 32);
    EXPECT_EQ(number_at<std::uint64_t>(file, entry.content + 36 + map_bytes + 8 + 4), chunk->size - 40);
    for (std::size_t at = entry.content + 36; at < entry.content + 36 + map_bytes; at += 10) {
      const auto channel = number_at<std::uint16_t>(file, at);
      const auto index = std::ranges::find(records, number_at<std::uint64_t>(file, at + 2), &RecordPlace::begin);
      ASSERT_NE(index, records.end());
      ASSERT_EQ(index->opcode, mcap_bytes::kMessageIndex);
      ASSERT_EQ(number_at<std::uint16_t>(file, index->content), channel);
      for (std::size_t k = index->content + 6; k < index->content + index->size; k += 16, ++indexed) {
        const std::size_t message = chunk->content + mcap_bytes::kChunkRecords + number_at<std::uint64_t>(file, k + 8);
        ASSERT_EQ(file[message], std::byte{mcap_bytes::kMessage});
        ASSERT_EQ(number_at<std::uint16_t>(file, message + 9), channel);
        ASSERT_EQ(number_at<std::int64_t>(file, message + 9 + 6), number_at<std::int64_t>(file, k));
      }
    }
  }
  EXPECT_EQ(chunks, std::ranges::count(records, std::uint8_t{mcap_bytes::kChunk}, &RecordPlace::opcode));
  EXPECT_EQ(indexed, messages.size());
}

TEST_F(McapFile, MoreChunksThanAFileHas_NextFileIsBegun) {
  std::vector<Message> messages;
  for (std::size_t i = 0; i < 2 * McapWriter::kMaxChunks + 3; ++i) {
    messages.push_back({i % 2, static_cast<std::int64_t>(i), 0, Bytes(20, static_cast<std::byte>(i)), true});
  }
  write(messages);
  std::span<const Message> left = messages;
  std::array<std::uint32_t, kChannels.size()> sequences{};
  for (unsigned part = 0; part < 3; ++part) {
    std::array<char, 512> path{};
    ASSERT_TRUE(McapWriter::path_of_part(path_, part, path));
    if (part > 0) {
      EXPECT_TRUE(std::string(path.data()).ends_with("run-" + std::to_string(part) + ".mcap"));
    }
    McapReader reader;
    ASSERT_TRUE(reader.open(path.data())) << reader.complaint();
    EXPECT_EQ(reader.read_run(), "000000000000002a");
    const std::size_t count = std::min(left.size(), McapWriter::kMaxChunks);
    MessageRead read;
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(reader.next(read), McapReader::Found::kMessage) << reader.complaint();
      ASSERT_TRUE(std::ranges::equal(read.data, left[i].data));
      ASSERT_EQ(read.sequence, sequences[left[i].channel]++) << "it goes on counting";
    }
    EXPECT_EQ(reader.next(read), McapReader::Found::kEnd);
    left = left.subspan(count);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "run-3.mcap"));
}

TEST_F(McapFile, PathOfPart_IsBesideTheFirst) {
  const auto path_of = [](std::string_view first, unsigned part) {
    std::array<char, 64> path{};
    return McapWriter::path_of_part(first, part, path) ? std::string(path.data()) : "too long";
  };
  EXPECT_EQ(path_of("a/run.mcap", 0), "a/run.mcap");
  EXPECT_EQ(path_of("a/run.mcap", 12), "a/run-12.mcap");
  EXPECT_EQ(path_of("a.b/run", 1), "a.b/run-1");
  EXPECT_EQ(path_of(std::string(64, 'x'), 0), "too long");
}

TEST_F(McapFile, MessageLargerThanItMayBe_IsRefusedAndTheFileIsWhole) {
  ASSERT_TRUE(writer_->open(path_, kChannels, 42));
  const Bytes large(McapWriter::kChunk_bytes / 2 + 1);
  EXPECT_FALSE(writer_->write(0, 1, 1, large));
  EXPECT_FALSE(writer_->write_alone(0, 1, 1, large, {}));
  EXPECT_EQ(writer_->error(), 0);
  const Message small{1, 2, 2, Bytes(3), false};
  EXPECT_TRUE(writer_->write(small.channel, small.log_ns, small.publish_ns, small.data));
  ASSERT_TRUE(writer_->close());
  expect_reads(path_, {&small, 1}, McapReader::Found::kEnd);
}

TEST_F(McapFile, DiskThatIsFull_IsAnErrorOnce) {
  EXPECT_FALSE(writer_->open("/dev/full", kChannels, 42));
  EXPECT_EQ(writer_->error(), ENOSPC);
  EXPECT_FALSE(writer_->close());
}

// What came is good, wherever the file ends.
TEST_F(McapFile, CutAnywhere_WholeChunksAreRead) {
  const std::vector<Message> messages = some_messages(60);
  write(messages);
  const Bytes file = read_file(path_);
  const auto places = mcap_bytes::messages_of(file);
  ASSERT_EQ(places.size(), messages.size());
  std::mt19937 random(4);
  for (int i = 0; i < 300; ++i) {
    const std::size_t size = 8 + random() % (file.size() - 8);
    write_file(path_, std::span(file).first(size));
    std::size_t whole = 0;
    for (const auto& place : places) {
      const auto records = number_at<std::uint64_t>(file, place.chunk + 32);
      whole += place.chunk + mcap_bytes::kChunkRecords + records <= size ? 1U : 0U;
    }
    McapReader reader;
    ASSERT_TRUE(reader.open(path_));
    MessageRead read;
    McapReader::Found found{};
    for (std::size_t n = 0; n < whole; ++n) ASSERT_EQ(found = reader.next(read), McapReader::Found::kMessage);
    found = reader.next(read);
    const bool has_footer = size >= file.size() - 8;
    EXPECT_EQ(found, has_footer ? McapReader::Found::kEnd : McapReader::Found::kCut) << size << reader.complaint();
    EXPECT_FALSE(reader.is_damaged());
  }
}

TEST_F(McapFile, FlippedBitOfAMessage_IsDamageOfItsChunkAlone) {
  write(some_messages(100));
  Bytes file = read_file(path_);
  const auto places = mcap_bytes::messages_of(file);
  const auto& place = places[places.size() / 2];
  mcap_bytes::flip_bit(file, place.data + 1, 3);
  write_file(path_, file);
  McapReader reader;
  ASSERT_TRUE(reader.open(path_));
  MessageRead read;
  for (const auto& each : places) {
    ASSERT_EQ(reader.next(read), McapReader::Found::kMessage);
    EXPECT_EQ(reader.is_damaged(), each.chunk >= place.chunk);
  }
  EXPECT_EQ(reader.damage(), "\"" + path_ + "\", byte " + std::to_string(place.chunk - 9) +
                                 ": the bytes of this chunk are not those that were written (CRC).");
  EXPECT_EQ(reader.next(read), McapReader::Found::kEnd);
}

TEST_F(McapFile, CompressedChunk_IsForWhoCanUnpackIt) {
  const Message message{0, 1, 1, Bytes(50, std::byte{9}), false};
  write({message});
  const Bytes plain = read_file(path_);
  const std::size_t chunk = mcap_bytes::messages_of(plain).front().chunk;
  // "x" turns every bit round; the record becomes one byte longer.
  Bytes packed(plain.begin(), plain.begin() + static_cast<std::ptrdiff_t>(chunk) + 28);
  const auto put = [&packed](auto value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    packed.insert(packed.end(), bytes.begin(), bytes.end());
  };
  const auto records = number_at<std::uint64_t>(plain, chunk + 32);
  put(std::uint32_t{1});
  put('x');
  put(records);
  for (std::size_t i = 0; i < records; ++i) packed.push_back(~plain[chunk + mcap_bytes::kChunkRecords + i]);
  packed.insert(packed.end(), plain.begin() + static_cast<std::ptrdiff_t>(chunk + mcap_bytes::kChunkRecords + records),
                plain.end());
  const std::uint64_t length = number_at<std::uint64_t>(plain, chunk - 8) + 1;
  std::memcpy(packed.data() + chunk - 8, &length, sizeof length);
  write_file(path_, packed);
  MessageRead read;
  McapReader without;
  ASSERT_TRUE(without.open(path_));
  EXPECT_EQ(without.next(read), McapReader::Found::kBad);
  EXPECT_NE(without.complaint().find("a chunk compressed by \"x\", which this program does not read."),
            std::string::npos);
  McapReader reader([](std::string_view by, std::span<const std::byte> from, std::span<std::byte> to) {
    std::ranges::transform(from, to.begin(), [](std::byte byte) { return ~byte; });
    return by == "x" && from.size() == to.size();
  });
  ASSERT_TRUE(reader.open(path_));
  ASSERT_EQ(reader.next(read), McapReader::Found::kMessage) << reader.complaint();
  EXPECT_TRUE(std::ranges::equal(read.data, message.data));
  EXPECT_FALSE(reader.is_damaged());
  EXPECT_EQ(reader.next(read), McapReader::Found::kEnd);
}

}  // namespace
}  // namespace polygmap::mcap
