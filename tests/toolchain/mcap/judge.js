// SPDX-License-Identifier: Apache-2.0
// judge.js RUN.mcap [SUMMARY.json]: reads a recording with MCAP's official reader. Every CRC is validated, every message
// decoded by the schema that the file has, standard schemas compared with their publishers' definitions, messages found
// by the index counted against those read in order, and counts against what the climb's summary says. One sentence and
// exit code 1 for the first thing that is wrong.
"use strict";
const fs = require("fs");
const { crc32Init, crc32Update, crc32Final } = require("@foxglove/crc");
const { parse } = require("@foxglove/rosmsg");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { foxgloveMessageSchemas, generateRosMsgDefinition } = require("@foxglove/schemas/internal");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");

const PIECE_BYTES = 1 << 22;
const MAGIC_BYTES = 8, FOOTER_BYTES = 9 + 20;  // with its opcode and length
const OWN_PACKAGE = "polygmap_msgs/";
const REWRITTEN = 50;  // of each topic's first messages; after them every hundredth
const PICTURE_GAP_NS = 50_000_000n;  // at 30 Hz

class Wrong extends Error {}
function expect(condition, sentence) {
  if (!condition) throw new Wrong(sentence);
}

// Name -> its fields, as ROS 2 and Foxglove publish them.
function official(name) {
  if (ros2humble[name] !== undefined) return ros2humble[name].definitions;
  const schema = Object.values(foxgloveMessageSchemas).find((s) => `foxglove_msgs/${s.name}` === name);
  return schema && generateRosMsgDefinition(schema, { rosVersion: 2 }).fields;
}
function text_of_fields(fields) {
  return fields.filter((f) => f.isConstant !== true && f.value === undefined)
      .map((f) => `${f.type.replace("/msg/", "/")}${f.isArray ? `[${f.arrayLength ?? ""}]` : ""} ${f.name}`).join(", ");
}
function check_schema(schema, definitions) {
  for (const definition of definitions) {
    const name = (definition.name ?? schema.name).replace("/msg/", "/");
    if (name.startsWith(OWN_PACKAGE)) continue;
    const published = official(name);
    expect(published !== undefined, `schema ${schema.name}: nobody publishes a ${name}.`);
    const [here, there] = [text_of_fields(definition.definitions), text_of_fields(published)];
    expect(here === there, `schema ${schema.name}: ${name} is "${here}", where its publisher has "${there}".`);
  }
}

// In order, record by record.
class Reading {
  constructor() {
    this.topics = new Map();  // channel -> {topic, reader, writer, count, times}
    this.schemas = new Map();
    this.statistics = undefined;
    this.verdict = undefined;
    this.start = undefined;
    this.end = undefined;
  }
  take(record) {
    if (record.type === "Schema") this.schemas.set(record.id, record);
    if (record.type === "Statistics") this.statistics = record;
    if (record.type === "Channel" && !this.topics.has(record.id)) this.take_channel(record);
    if (record.type === "Message") this.take_message(record);
  }
  take_channel(channel) {
    const schema = this.schemas.get(channel.schemaId);
    expect(schema !== undefined, `topic ${channel.topic}: its schema does not come before it.`);
    expect(schema.encoding === "ros2msg" && channel.messageEncoding === "cdr",
           `topic ${channel.topic} is ${schema.encoding} in ${channel.messageEncoding}, not ros2msg in cdr.`);
    const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
    check_schema(schema, definitions);
    this.topics.set(channel.id, { topic: channel.topic, reader: new MessageReader(definitions),
                                  writer: new MessageWriter(definitions), count: 0, stamps: [] });
  }
  take_message(record) {
    const of = this.topics.get(record.channelId);
    const which = `topic ${of.topic}, message ${of.count}`;
    expect(record.sequence === of.count, `${which}: its number is ${record.sequence}: one is missing.`);
    let message;
    try {
      message = of.reader.readMessage(record.data);
    } catch (error) {
      throw new Wrong(`${which} cannot be decoded: ${error.message}.`);
    }
    if (of.count < REWRITTEN || of.count % 100 === 0) {  // no byte is left over, and none is missing
      const again = of.writer.writeMessage(message);
      expect(Buffer.compare(Buffer.from(again), Buffer.from(record.data)) === 0,
             `${which}: ${record.data.byteLength} bytes are not what its schema makes of them, ${again.byteLength}.`);
    }
    ++of.count;
    if (of.topic === "/depth") of.stamps.push(record.publishTime);
    if (of.topic === "/verdict") this.verdict = JSON.parse(message.json);
    if (this.start === undefined || record.logTime < this.start) this.start = record.logTime;
    if (this.end === undefined || record.logTime > this.end) this.end = record.logTime;
  }
  count_of(topic) {
    return [...this.topics.values()].find((t) => t.topic === topic)?.count ?? 0;
  }
}

function pieces(file, begin, end, take) {
  const buffer = Buffer.alloc(PIECE_BYTES);
  for (let at = begin; at < end;) {
    const read = fs.readSync(file, buffer, 0, Math.min(PIECE_BYTES, end - at), at);
    expect(read > 0, "the file cannot be read.");
    take(buffer.subarray(0, read));
    at += read;
  }
}
function crc_of(file, begin, end) {
  let crc = crc32Init();
  pieces(file, begin, end, (piece) => { crc = crc32Update(crc, piece); });
  return crc32Final(crc);
}

function read_in_order(file, size) {
  const reader = new McapStreamReader({ validateCrcs: true });
  const reading = new Reading();
  let data_end, footer;
  pieces(file, 0, size, (piece) => {
    reader.append(piece.slice());
    for (let record; (record = reader.nextRecord()) !== undefined;) {
      if (record.type === "DataEnd") data_end = record;
      if (record.type === "Footer") footer = record;
      reading.take(record);
    }
  });
  expect(reader.done(), "the file ends before its end.");
  const summary = Number(footer.summaryStart);
  if (data_end.dataSectionCrc !== 0) {  // the record DataEnd is before the summary
    expect(crc_of(file, 0, summary - 9 - 4) === data_end.dataSectionCrc, "the CRC of the data section is wrong.");
  }
  if (footer.summaryCrc !== 0) {
    expect(crc_of(file, summary, size - MAGIC_BYTES - 4) === footer.summaryCrc, "the CRC of the summary is wrong.");
  }
  return reading;
}

function check_statistics(reading) {
  const statistics = reading.statistics;
  expect(statistics !== undefined, "there are no statistics.");
  let messages = 0;
  for (const [id, of] of reading.topics) {
    const said = Number(statistics.channelMessageCounts.get(id) ?? 0);
    expect(said === of.count, `topic ${of.topic} has ${of.count} messages, where the statistics say ${said}.`);
    messages += of.count;
  }
  expect(Number(statistics.messageCount) === messages,
         `there are ${messages} messages, where the statistics say ${statistics.messageCount}.`);
  expect(statistics.messageStartTime === reading.start && statistics.messageEndTime === reading.end,
         "the times in the statistics are not those of the messages.");
}

// By the index, as a viewer seeks: all of it, and a second in the middle.
async function check_index(path, reading) {
  const handle = await fs.promises.open(path);
  const readable = {
    size: async () => BigInt((await handle.stat()).size),
    read: async (at, length) => {
      const bytes = new Uint8Array(Number(length));
      await handle.read(bytes, 0, bytes.length, Number(at));
      return bytes;
    },
  };
  const indexed = await McapIndexedReader.Initialize({ readable });
  const counts = new Map();
  for await (const message of indexed.readMessages()) {
    counts.set(message.channelId, (counts.get(message.channelId) ?? 0) + 1);
  }
  for (const [id, of] of reading.topics) {
    const found = counts.get(id) ?? 0;
    expect(found === of.count, `topic ${of.topic}: the index leads to ${found} of ${of.count} messages.`);
  }
  const [from, to] = [(reading.start + reading.end) / 2n, (reading.start + reading.end) / 2n + 1_000_000_000n];
  let sought = 0;
  for await (const message of indexed.readMessages({ topics: ["/frame"], startTime: from, endTime: to })) {
    expect(message.logTime >= from && message.logTime <= to, "a message that was sought lies outside its time.");
    ++sought;
  }
  expect(sought > 0 || reading.count_of("/frame") === 0, "nothing is found where it is sought.");
  await handle.close();
}

function check_summary(reading, path) {
  const summary = JSON.parse(fs.readFileSync(path, "utf8"));
  const runs = (task) => summary.schedule.find((row) => row.task === task).runs;
  const counts = [["/frame", runs("sense"), "ticks"], ["/odometry", runs("estimate"), "estimates"],
                  ["/gait", runs("gait"), "runs of the gait"], ["/surfaces", summary.surfaces.frames, "pictures"],
                  ["/verdict", 1, "verdict"], ["/camera_info", reading.count_of("/depth"), "pictures of /depth"]];
  for (const [topic, said, what] of counts) {
    const found = reading.count_of(topic);
    expect(found === said, `topic ${topic} has ${found} messages, where there were ${said} ${what}.`);
  }
  expect(reading.verdict.verdict === summary.verdict, "the verdict in /verdict is not that of the summary.");
  const stamps = [...reading.topics.values()].find((t) => t.topic === "/depth").stamps;
  for (let i = 1; i < stamps.length; ++i) {
    expect(stamps[i] - stamps[i - 1] < PICTURE_GAP_NS, `a picture is missing in /depth after number ${i - 1}.`);
  }
}

async function main() {
  const [path, summary] = process.argv.slice(2);
  const file = fs.openSync(path, "r");
  const reading = read_in_order(file, fs.fstatSync(file).size);
  check_statistics(reading);
  await check_index(path, reading);
  if (summary !== undefined) check_summary(reading, summary);
  let messages = 0;
  for (const of of reading.topics.values()) messages += of.count;
  console.log(`${messages} messages of ${reading.topics.size} topics`);
}
main().catch((error) => {
  console.error(`mcap: error: ${process.argv[2]}: ${error.message}`);
  process.exit(1);
});
