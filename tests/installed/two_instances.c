// SPDX-License-Identifier: Apache-2.0
// two_instances STREAM: two instances in one process, the second a second behind the first. Each commands what it
// commands alone. A third one with other parameters, fed the same, does not.
#include <polygmap.h>
#include <stdalign.h>
#include <string.h>

#include "stream.h"

static alignas(POLYGMAP_ALIGNMENT) unsigned char memory[3][POLYGMAP_MEMORY_BYTES];
static stream_record record;

typedef struct replayed {
  polygmap* instance;
  FILE* from;
  unsigned long commands, differ;
} replayed;

// Up to its next step; 0: its stream is over.
static int go_on(replayed* one) {
  while (stream_read(one->from, &record)) {
    polygmap_command command;
    if (record.kind == STREAM_STEP) return polygmap_step(one->instance, record.of.now_ns) == POLYGMAP_OK;
    if (record.kind == STREAM_COMMAND) {
      memset(&command, 0, sizeof command);
      command.size = sizeof command;
      ++one->commands;
      one->differ += polygmap_read_command(one->instance, &command) != POLYGMAP_OK ||
                     memcmp(&command, &record.of.command, sizeof command) != 0;
    } else if (stream_push(one->instance, &record) != POLYGMAP_OK) {
      return 0;
    }
  }
  return 0;
}

int main(int argc, char** argv) {
  static const char* const configs[3] = {NULL, NULL, "[robot.drives]\nkp_nmprad = [410, 400, 400, 400, 120, 120]\n"};
  replayed all[3] = {{0}};
  for (int i = 0; i < 3; ++i) {
    all[i].from = argc == 2 ? fopen(argv[1], "rb") : NULL;
    if (all[i].from == NULL) stream_fail("cannot be opened");
    if (polygmap_create(&all[i].instance, memory[i], sizeof memory[i], configs[i]) != POLYGMAP_OK) return 1;
  }
  for (long step = 0; step < 3000; ++step) {
    for (int i = 0; i < 3; ++i) {
      if ((i != 1 || step >= 500) && !go_on(&all[i])) return 1;
    }
  }
  for (int i = 0; i < 3; ++i) printf("instance %d: %lu commands, %lu differ\n", i, all[i].commands, all[i].differ);
  return all[0].differ == 0 && all[1].differ == 0 && all[2].differ > 0 && all[1].commands > 2000 ? 0 : 1;
}
