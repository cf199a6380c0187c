// SPDX-License-Identifier: Apache-2.0
// replay STREAM: feeds a stream to an instance and compares what it commands, to the bit. C11.
#include <polygmap.h>
#include <stdalign.h>
#include <string.h>

#include "stream.h"

static alignas(POLYGMAP_ALIGNMENT) unsigned char memory[POLYGMAP_MEMORY_BYTES];
static stream_record record;

int main(int argc, char** argv) {
  FILE* from = argc == 2 ? fopen(argv[1], "rb") : NULL;
  if (from == NULL) stream_fail("cannot be opened");

  polygmap* instance = NULL;
  int error = polygmap_create(&instance, memory, sizeof memory, NULL);
  unsigned long steps = 0, commands = 0, pictures = 0, differ = 0;
  while (error == POLYGMAP_OK && stream_read(from, &record)) {
    polygmap_command command;
    memset(&command, 0, sizeof command);
    command.size = sizeof command;
    pictures += record.kind == STREAM_DEPTH;
    if (record.kind == STREAM_STEP) {
      ++steps;
      error = polygmap_step(instance, record.of.now_ns);
    } else if (record.kind == STREAM_COMMAND) {
      ++commands;
      error = polygmap_read_command(instance, &command);
      if (memcmp(&command, &record.of.command, sizeof command) != 0) ++differ;
    } else if (record.kind == STREAM_NO_COMMAND) {
      if (polygmap_read_command(instance, &command) != POLYGMAP_E_NONE) ++differ;
    } else {
      error = stream_push(instance, &record);
    }
  }
  polygmap_status status = {sizeof status};
  if (error == POLYGMAP_OK) error = polygmap_read_status(instance, &status);
  printf("%s: %lu steps, %lu pictures, %lu commands, %lu differ, %u treads climbed, %s: %s\n", polygmap_version(),
         steps, pictures, commands, differ, status.treads_climbed, polygmap_state_name(status.state),
         polygmap_error_text(error));
  polygmap_destroy(instance);
  const int complete = commands > 1000 && pictures > 50 && status.cycles.run == steps;
  return error == POLYGMAP_OK && differ == 0 && complete ? 0 : 1;
}
