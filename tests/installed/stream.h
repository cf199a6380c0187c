// SPDX-License-Identifier: Apache-2.0
// What link_stream writes and these programs read: records of a kind and a struct of polygmap.h as it lies in memory,
// for programs of one machine and one build. Whatever is to be pushed before a step stands before it, what the module
// commanded in it behind it.
#pragma once

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum {
  STREAM_IMU = 1,
  STREAM_JOINTS,
  STREAM_LIO,
  STREAM_DEPTH,      // its pixels follow
  STREAM_STEP,       // int64_t now_ns
  STREAM_COMMAND,    // of the step before
  STREAM_NO_COMMAND  // nothing follows
};

enum { STREAM_PIXELS = 640 * 480 };

typedef struct stream_record {
  uint32_t kind;
  union {
    polygmap_imu imu;
    polygmap_joints joints;
    polygmap_lio lio;
    polygmap_depth depth;
    polygmap_command command;
    int64_t now_ns;
  } of;
  uint16_t pixels[STREAM_PIXELS];
} stream_record;

static inline void stream_fail(const char* what) {
  fprintf(stderr, "the stream %s\n", what);
  exit(1);
}
static inline void stream_fill(FILE* from, void* to, size_t bytes) {
  if (fread(to, 1, bytes, from) != bytes) stream_fail("ends within a record");
}

// 0: there is no more.
static inline int stream_read(FILE* from, stream_record* record) {
  if (fread(&record->kind, sizeof record->kind, 1, from) != 1) return 0;
  switch (record->kind) {
    case STREAM_IMU:
      stream_fill(from, &record->of.imu, sizeof record->of.imu);
      break;
    case STREAM_JOINTS:
      stream_fill(from, &record->of.joints, sizeof record->of.joints);
      break;
    case STREAM_LIO:
      stream_fill(from, &record->of.lio, sizeof record->of.lio);
      break;
    case STREAM_DEPTH:
      stream_fill(from, &record->of.depth, sizeof record->of.depth);
      stream_fill(from, record->pixels, sizeof record->pixels);
      record->of.depth.pixels = record->pixels;
      break;
    case STREAM_STEP:
      stream_fill(from, &record->of.now_ns, sizeof record->of.now_ns);
      break;
    case STREAM_COMMAND:
      stream_fill(from, &record->of.command, sizeof record->of.command);
      break;
    case STREAM_NO_COMMAND:
      break;
    default:
      stream_fail("has a record of an unknown kind");
  }
  return 1;
}

// What is to be pushed of it; 0 for other kinds.
static inline int stream_push(polygmap* instance, const stream_record* record) {
  switch (record->kind) {
    case STREAM_IMU:
      return polygmap_push_imu(instance, &record->of.imu);
    case STREAM_JOINTS:
      return polygmap_push_joints(instance, &record->of.joints);
    case STREAM_LIO:
      return polygmap_push_lio(instance, &record->of.lio);
    case STREAM_DEPTH:
      return polygmap_push_depth(instance, &record->of.depth);
    default:
      return 0;
  }
}
