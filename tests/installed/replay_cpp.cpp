// SPDX-License-Identifier: Apache-2.0
// replay_cpp STREAM: as replay.c, by the C++ header and in C++17, with another clock: its stamps count from 1970, which
// changes nothing but the stamps.
#include <cstdio>
#include <cstring>
#include <polygmap.hpp>

#include "stream.h"

namespace {

constexpr std::int64_t kSince1970_ns = 1'764'000'000'000'000'000;

alignas(POLYGMAP_ALIGNMENT) unsigned char memory[POLYGMAP_MEMORY_BYTES];
stream_record record;

template <class Struct>
int push_later(polygmap_module::Module& module, Struct sample) {
  sample.stamp_ns += kSince1970_ns;
  return module.push(sample);
}

int push(polygmap_module::Module& module) {
  switch (record.kind) {
    case STREAM_IMU:
      return push_later(module, record.of.imu);
    case STREAM_JOINTS:
      return push_later(module, record.of.joints);
    case STREAM_LIO:
      return push_later(module, record.of.lio);
    case STREAM_DEPTH:
      return push_later(module, record.of.depth);
    case STREAM_STEP:
      return module.step(record.of.now_ns + kSince1970_ns);
    default:
      return POLYGMAP_OK;
  }
}

}  // namespace

int main(int argc, char** argv) {
  FILE* from = argc == 2 ? std::fopen(argv[1], "rb") : nullptr;
  if (from == nullptr) stream_fail("cannot be opened");
  polygmap_module::Module made(memory, sizeof memory);
  polygmap_module::Module module(std::move(made));
  int error = made ? POLYGMAP_E_INSTANCE : module.error();  // moved from, it is none
  unsigned long commands = 0, differ = 0;
  while (error == POLYGMAP_OK && stream_read(from, &record) != 0) {
    error = push(module);
    if (record.kind != STREAM_COMMAND) continue;
    polygmap_command command;
    std::memset(&command, 0, sizeof command);
    error = module.read(command);
    command.stamp_ns -= kSince1970_ns;
    ++commands;
    if (std::memcmp(&command, &record.of.command, sizeof command) != 0) ++differ;
  }
  auto plan = polygmap_module::sized<polygmap_plan>();
  if (error == POLYGMAP_OK) error = module.read(plan);
  std::printf("%lu commands, %lu differ, %u bodies, %u polygons, rise %.3f m, tread %.3f m: %s\n", commands, differ,
              plan.body_count, plan.polygon_count, plan.stairs.rise_m, plan.stairs.tread_m, polygmap_error_text(error));
  return error == POLYGMAP_OK && differ == 0 && commands > 1000 ? 0 : 1;
}
