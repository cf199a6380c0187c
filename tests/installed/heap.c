// SPDX-License-Identifier: Apache-2.0
// heap STREAM: what glibc counts of its heap before polygmap_create() it counts after 10,000 steps.
#include <malloc.h>
#include <polygmap.h>
#include <stdalign.h>

#include "stream.h"

static alignas(POLYGMAP_ALIGNMENT) unsigned char memory[POLYGMAP_MEMORY_BYTES];
static stream_record record;
static polygmap_plan plan = {sizeof plan};

int main(int argc, char** argv) {
  FILE* from = argc == 2 ? fopen(argv[1], "rb") : NULL;
  if (from == NULL || !stream_read(from, &record)) stream_fail("cannot be read");  // the file's buffer is there now
  polygmap* instance = NULL;
  polygmap_command command = {sizeof command};
  polygmap_pose pose = {sizeof pose};
  polygmap_status status = {sizeof status};
  polygmap_faults faults = {sizeof faults};
  long steps = 0;
  int64_t now_ns = 0;

  const struct mallinfo2 before = mallinfo2();
  int error = polygmap_create(&instance, memory, sizeof memory, "[gait.planner]\npattern = \"ds\"\n");
  while (error == POLYGMAP_OK && stream_read(from, &record)) {
    if (record.kind == STREAM_STEP) {
      now_ns = record.of.now_ns;
      error = polygmap_step(instance, now_ns);
      ++steps;
      (void)polygmap_read_command(instance, &command);
      (void)polygmap_read_pose(instance, &pose);
      (void)polygmap_read_plan(instance, &plan);
    } else {
      error = stream_push(instance, &record);
    }
  }
  // On with sensors that are silent: it brings the robot to a stop.
  for (; error == POLYGMAP_OK && steps < 10000; ++steps) error = polygmap_step(instance, now_ns += POLYGMAP_CYCLE_NS);
  if (error == POLYGMAP_OK) error = polygmap_read_status(instance, &status);
  if (error == POLYGMAP_OK) error = polygmap_read_faults(instance, &faults);
  const struct mallinfo2 after = mallinfo2();

  printf("%ld steps, %s, %u faults; heap in use %zu then %zu, mapped %zu then %zu: %s\n", steps,
         polygmap_state_name(status.state), faults.count, before.uordblks, after.uordblks, before.hblkhd, after.hblkhd,
         polygmap_error_text(error));
  const int unmoved = before.uordblks == after.uordblks && before.hblkhd == after.hblkhd &&
                      before.arena == after.arena && before.ordblks == after.ordblks;
  return error == POLYGMAP_OK && steps == 10000 && unmoved && before.uordblks > 0 ? 0 : 1;
}
