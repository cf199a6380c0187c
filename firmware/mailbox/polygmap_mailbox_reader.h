// SPDX-License-Identifier: Apache-2.0
// Reads the mailbox of polygmap_mailbox.h: opens it, checks it, copies sections out, and tells when its writer is gone.
// C11 (with POSIX.1-2008) and C++. Everything is in this file; nothing is allocated, and nobody is waited for.
//
//   polygmap_mailbox_reader reader = POLYGMAP_MAILBOX_READER;
//   char why[POLYGMAP_MAILBOX_SENTENCE];
//   if (polygmap_mailbox_attach(&reader, POLYGMAP_MAILBOX_NAME, why) == POLYGMAP_MAILBOX_OK) {
//     polygmap_mailbox_pose pose;
//     if (polygmap_mailbox_try_copy(&reader.box->pose_lock, &reader.box->pose, &pose, sizeof pose)) ...
//   }
#pragma once

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

#include "polygmap_mailbox.h"

enum { POLYGMAP_MAILBOX_SENTENCE = 256 };  // bytes that hold every sentence

typedef enum polygmap_mailbox_result {
  POLYGMAP_MAILBOX_OK = 0,
  POLYGMAP_MAILBOX_ABSENT,         // nobody has made it, or it is only being made
  POLYGMAP_MAILBOX_NOT_PERMITTED,  // this user may not read it
  POLYGMAP_MAILBOX_TOO_SMALL,
  POLYGMAP_MAILBOX_FOREIGN,       // something else has that name
  POLYGMAP_MAILBOX_OTHER_LAYOUT,  // its writer was built with another polygmap_mailbox.h
  POLYGMAP_MAILBOX_CLOSED,        // its writer has ended as it should
  POLYGMAP_MAILBOX_DEAD,          // its writer's process is gone
  POLYGMAP_MAILBOX_SILENT,        // its writer's process is there, or cannot be looked at, and writes nothing
  POLYGMAP_MAILBOX_FAILED         // a call of the system did
} polygmap_mailbox_result;

typedef struct polygmap_mailbox_reader {
  const polygmap_mailbox* box;  // null: not attached
  uint64_t seen_sequence;       // of the status, as polygmap_mailbox_look() saw it
  int64_t moved_ns;             // CLOCK_MONOTONIC; when that was another one last
} polygmap_mailbox_reader;
// clang-format off
#define POLYGMAP_MAILBOX_READER {NULL, 0, 0}
// clang-format on

static inline int64_t polygmap_mailbox_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static inline void polygmap_mailbox_detach(polygmap_mailbox_reader* reader) {
  if (reader->box != NULL) munmap((void*)(uintptr_t)reader->box, sizeof *reader->box);
  reader->box = NULL;
}

// Reads one that may change at any moment.
static inline uint64_t polygmap_mailbox_load(const uint64_t* value) { return __atomic_load_n(value, __ATOMIC_ACQUIRE); }

// Field 22 of /proc/PID/stat, after the name in brackets, which may hold anything; the state, field 3, likewise. 0, and
// '?', where there is none that could be read.
static inline uint64_t polygmap_mailbox_start_ticks(int64_t pid, char* state) {
  char path[48], text[1024];
  *state = '?';
  snprintf(path, sizeof path, "/proc/%lld/stat", (long long)pid);
  FILE* file = fopen(path, "r");
  if (file == NULL) return 0;
  const size_t length = fread(text, 1, sizeof text - 1, file);
  fclose(file);
  text[length] = '\0';
  const char* at = strrchr(text, ')');
  if (at != NULL && at[1] == ' ' && at[2] != '\0') *state = at[2];
  for (int field = 2; at != NULL && field < 22; ++field) at = strchr(at + 1, ' ');
  return at == NULL ? 0 : strtoull(at, NULL, 10);
}

// Whether the writer's process is there. One that cannot be seen from here, from within a container, is not.
static inline bool polygmap_mailbox_writer_lives(const polygmap_mailbox_header* header) {
  char state;
  const uint64_t ticks = polygmap_mailbox_start_ticks(header->writer_pid, &state);
  const bool ended = state == 'Z' || state == 'X' ||
                     (ticks != 0 && header->writer_start_ticks != 0 && ticks != header->writer_start_ticks);
  return !ended && (kill((pid_t)header->writer_pid, 0) == 0 || errno != ESRCH);
}
static inline bool polygmap_mailbox_is_torn(const polygmap_mailbox* box) {
  return (polygmap_mailbox_load(&box->pose_lock.sequence) | polygmap_mailbox_load(&box->status_lock.sequence) |
          polygmap_mailbox_load(&box->plan_lock.sequence) | polygmap_mailbox_load(&box->timing_lock.sequence) |
          polygmap_mailbox_load(&box->events_lock.sequence)) %
             2 !=
         0;
}

// Not OK, with a sentence: it cannot be read by this program.
static inline polygmap_mailbox_result polygmap_mailbox_check(const polygmap_mailbox* box, const char* name,
                                                             char why[POLYGMAP_MAILBOX_SENTENCE]) {
  const polygmap_mailbox_header* header = &box->header;
  const uint64_t magic = polygmap_mailbox_load(&header->magic);
  if (magic == 0) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The mailbox %s is only being made.", name);
    return POLYGMAP_MAILBOX_ABSENT;
  }
  if (magic != POLYGMAP_MAILBOX_MAGIC) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The shared memory %s is no mailbox of PolygMap's.", name);
    return POLYGMAP_MAILBOX_FOREIGN;
  }
  const bool same = header->version == POLYGMAP_MAILBOX_VERSION &&
                    header->layout_hash == polygmap_mailbox_layout_hash() && header->segment_bytes == sizeof *box;
  if (!same) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE,
             "The mailbox %s has version %u and layout %016llx, and this program reads version %u and layout %016llx: "
             "build it with the writer's polygmap_mailbox.h.",
             name, (unsigned)header->version, (unsigned long long)header->layout_hash, POLYGMAP_MAILBOX_VERSION,
             (unsigned long long)polygmap_mailbox_layout_hash());
    return POLYGMAP_MAILBOX_OTHER_LAYOUT;
  }
  return POLYGMAP_MAILBOX_OK;
}

// How its writer is, by what it has written since the last look and, when that is nothing for silent_ms, by its
// process. What is not OK comes with a sentence: it is time to attach anew. Without a system call but for the clock
// while it moves.
static inline polygmap_mailbox_result polygmap_mailbox_look(polygmap_mailbox_reader* reader, int silent_ms,
                                                            char why[POLYGMAP_MAILBOX_SENTENCE]) {
  const polygmap_mailbox_header* header = &reader->box->header;
  const int64_t now_ns = polygmap_mailbox_now_ns();
  const uint64_t sequence = polygmap_mailbox_load(&reader->box->status_lock.sequence);
  why[0] = '\0';
  if (__atomic_load_n(&header->state, __ATOMIC_ACQUIRE) == POLYGMAP_MAILBOX_IS_CLOSED) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The writer, process %lld, has closed the mailbox.",
             (long long)header->writer_pid);
    return POLYGMAP_MAILBOX_CLOSED;
  }
  if (sequence != reader->seen_sequence) {
    reader->seen_sequence = sequence;
    reader->moved_ns = now_ns;
    return POLYGMAP_MAILBOX_OK;
  }
  const int64_t silent_ns = now_ns - reader->moved_ns;
  if (silent_ns < (int64_t)silent_ms * 1000000) return POLYGMAP_MAILBOX_OK;
  const char* const torn = polygmap_mailbox_is_torn(reader->box) ? ", in the middle of a write" : "";
  if (!polygmap_mailbox_writer_lives(header)) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The writer, process %lld, has died%s.", (long long)header->writer_pid,
             torn);
    return POLYGMAP_MAILBOX_DEAD;
  }
  snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The writer, process %lld, has written nothing for %lld ms%s.",
           (long long)header->writer_pid, (long long)(silent_ns / 1000000), torn);
  return POLYGMAP_MAILBOX_SILENT;
}

// Maps the mailbox of that name, "/polygmap" as in /dev/shm/polygmap, read-only. Otherwise why holds one sentence.
static inline polygmap_mailbox_result polygmap_mailbox_attach(polygmap_mailbox_reader* reader, const char* name,
                                                              char why[POLYGMAP_MAILBOX_SENTENCE]) {
  polygmap_mailbox_detach(reader);
  why[0] = '\0';
  const int fd = shm_open(name, O_RDONLY, 0);
  if (fd < 0) {
    const bool absent = errno == ENOENT, forbidden = errno == EACCES || errno == EPERM;
    if (absent) {
      snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "There is no mailbox %s: nobody writes one.", name);
    } else if (forbidden) {
      snprintf(why, POLYGMAP_MAILBOX_SENTENCE,
               "This user may not read the mailbox %s: it takes membership in the group of /dev/shm%s.", name, name);
    } else {
      snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The mailbox %s cannot be opened: %s.", name, strerror(errno));
    }
    return absent ? POLYGMAP_MAILBOX_ABSENT : forbidden ? POLYGMAP_MAILBOX_NOT_PERMITTED : POLYGMAP_MAILBOX_FAILED;
  }
  struct stat about;
  polygmap_mailbox_result result = POLYGMAP_MAILBOX_OK;
  void* mapped = MAP_FAILED;
  if (fstat(fd, &about) != 0) {
    result = POLYGMAP_MAILBOX_FAILED;
  } else if (about.st_size == 0) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The mailbox %s is only being made.", name);
    result = POLYGMAP_MAILBOX_ABSENT;
  } else if (about.st_size < (off_t)sizeof(polygmap_mailbox)) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE,
             "The shared memory %s has %lld bytes, and a mailbox as this program knows it has %zu.", name,
             (long long)about.st_size, sizeof(polygmap_mailbox));
    result = POLYGMAP_MAILBOX_TOO_SMALL;
  } else {
    mapped = mmap(NULL, sizeof(polygmap_mailbox), PROT_READ, MAP_SHARED, fd, 0);
    if (mapped == MAP_FAILED) result = POLYGMAP_MAILBOX_FAILED;
  }
  if (result == POLYGMAP_MAILBOX_FAILED) {
    snprintf(why, POLYGMAP_MAILBOX_SENTENCE, "The mailbox %s cannot be mapped: %s.", name, strerror(errno));
  }
  close(fd);
  if (result != POLYGMAP_MAILBOX_OK) return result;
  reader->box = (const polygmap_mailbox*)mapped;
  result = polygmap_mailbox_check(reader->box, name, why);
  if (result == POLYGMAP_MAILBOX_OK) {
    reader->seen_sequence = polygmap_mailbox_load(&reader->box->status_lock.sequence);
    reader->moved_ns = polygmap_mailbox_now_ns();
    // What a dead writer has left is no mailbox to read on. One that is not seen may write nevertheless.
    const struct timespec some_cycles = {0, 20000000};
    if (!polygmap_mailbox_writer_lives(&reader->box->header)) {
      nanosleep(&some_cycles, NULL);
      result = polygmap_mailbox_look(reader, 0, why);
    }
  }
  if (result != POLYGMAP_MAILBOX_OK) polygmap_mailbox_detach(reader);
  return result;
}
