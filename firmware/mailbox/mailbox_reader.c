// SPDX-License-Identifier: Apache-2.0
// A program beside the module: prints what the mailbox says, up to 500 times a second.
//
//   cc -std=c11 -O2 mailbox_reader.c -o mailbox_reader
//   ./mailbox_reader [--name /polygmap] [--rate HZ] [--lines N] [--silent-ms MS] [--once]
//
// It waits for a writer, reads whole sections or none, says in a sentence when the writer is gone, and goes on with the
// next one. Exit codes: 0 ended by SIGINT, SIGTERM or --lines; with --once also when the writer is gone; 1 this mailbox
// cannot be read; 2 wrong arguments.
#define _POSIX_C_SOURCE 200809L

#include <inttypes.h>

#include "polygmap_mailbox_reader.h"

typedef struct options {
  const char* name;
  long rate_hz, lines, silent_ms;  // lines: 0: without end
  bool once;
} options;

static volatile sig_atomic_t stop_asked = 0;
static void ask_to_stop(int number) {
  (void)number;
  stop_asked = 1;
}

static bool read_number(const char* text, long least, long most, long* number) {
  char* end = NULL;
  errno = 0;
  *number = strtol(text, &end, 10);
  return errno == 0 && *text != '\0' && *end == '\0' && *number >= least && *number <= most;
}

static bool read_options(int argc, char** argv, options* o) {
  for (int i = 1; i < argc; ++i) {
    const char* const value = i + 1 < argc ? argv[i + 1] : "";
    bool good = true;
    if (strcmp(argv[i], "--once") == 0) {
      o->once = true;
      continue;
    } else if (strcmp(argv[i], "--name") == 0) {
      o->name = value;
      good = value[0] == '/';
    } else if (strcmp(argv[i], "--rate") == 0) {
      good = read_number(value, 1, 1000, &o->rate_hz);
    } else if (strcmp(argv[i], "--lines") == 0) {
      good = read_number(value, 1, 1000000000, &o->lines);
    } else if (strcmp(argv[i], "--silent-ms") == 0) {
      good = read_number(value, 1, 60000, &o->silent_ms);
    } else {
      good = false;
    }
    if (!good) {
      fprintf(stderr,
              "mailbox_reader: %s %s is no argument; there are --name /NAME, --rate 1 to 1000, --lines N, "
              "--silent-ms 1 to 60000 and --once.\n",
              argv[i], value);
      return false;
    }
    ++i;
  }
  return true;
}

static void sleep_until(int64_t due_ns) {
  const struct timespec due = {due_ns / 1000000000, due_ns % 1000000000};
  while (!stop_asked && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL) == EINTR) {
  }
}

typedef struct sections {
  polygmap_mailbox_pose pose;
  polygmap_mailbox_status status;
  polygmap_plan plan;  // without its polygons
} sections;

// Of a simulation, whose time stands still between its cycles, as of its newest status.
static int64_t now_ns(const polygmap_mailbox* box, const polygmap_mailbox_status* status) {
  return box->header.clock == POLYGMAP_MAILBOX_VIRTUAL ? status->stamp_ns : polygmap_mailbox_now_ns();
}

static void print_age(const char* what, int64_t stamp_ns, int64_t now) {
  if (stamp_ns == 0) {
    printf("%s none", what);
  } else {
    printf("%s %.1f ms", what, 1e-6 * (double)(now - stamp_ns));
  }
}

static void print_line(const polygmap_mailbox* box, const sections* s) {
  static const char* const kFeet[] = {"left", "right"};
  static const char* const kCertainties[] = {"latched", "planned", "expected"};
  const int64_t now = now_ns(box, &s->status);
  const uint32_t state = s->status.module_state, phase = s->status.gait_phase;
  printf("%.3f %s %s;", 1e-9 * (double)s->status.stamp_ns,
         state < POLYGMAP_MAILBOX_NAMES ? box->names.module_states[state].text : "?",
         phase < POLYGMAP_MAILBOX_NAMES ? box->names.gait_phases[phase].text : "?");
  print_age(" age of pose", s->pose.stamp_ns, now);
  print_age(", plan", s->plan.stamp_ns, now);
  print_age(", picture", s->status.picture_stamp_ns, now);
  print_age(", map", s->status.map_stamp_ns, now);
  print_age(", lidar", s->status.lio_stamp_ns, now);
  printf("; base %.3f %.3f %.3f", s->pose.odom_p_base_m[0], s->pose.odom_p_base_m[1], s->pose.odom_p_base_m[2]);
  for (uint32_t i = 0; i < s->plan.step_count && i < POLYGMAP_MAX_STEPS; ++i) {
    const polygmap_foot_target* step = &s->plan.step[i];
    const char* const certainty = kCertainties[(uint32_t)step->certainty % 3];
    printf("; %s %s to %.3f %.3f %.3f yaw %.3f", certainty, kFeet[step->foot == 1], step->x_m, step->y_m, step->z_m,
           step->yaw_rad);
    if (step->touch_down_ns != 0) printf(" in %.3f s", 1e-9 * (double)(step->touch_down_ns - now));
  }
  if (s->plan.body_count > 0) {
    const polygmap_body* body = &s->plan.body[0];
    printf("; com %.3f %.3f %.3f, torso %.3f %.3f %.3f", body->com_m[0], body->com_m[1], body->com_m[2],
           body->torso_m[0], body->torso_m[1], body->torso_m[2]);
  }
  printf("; %u contacts, %u polygons, rise %.3f tread %.3f heading %.3f\n", s->plan.contact_count,
         s->plan.polygon_count, s->plan.stairs.rise_m, s->plan.stairs.tread_m, s->plan.stairs.heading_rad);
  fflush(stdout);
}

// Waits for a writer. False: this mailbox cannot be read, or it was asked to stop.
static bool attach(polygmap_mailbox_reader* reader, const options* o, bool* cannot) {
  char why[POLYGMAP_MAILBOX_SENTENCE], said[POLYGMAP_MAILBOX_SENTENCE] = "";
  while (!stop_asked) {
    const polygmap_mailbox_result result = polygmap_mailbox_attach(reader, o->name, why);
    if (result == POLYGMAP_MAILBOX_OK) return true;
    const bool waits =
        result == POLYGMAP_MAILBOX_ABSENT || result == POLYGMAP_MAILBOX_CLOSED || result == POLYGMAP_MAILBOX_DEAD;
    if (strcmp(why, said) != 0) fprintf(stderr, "mailbox_reader: %s%s\n", why, waits ? " Waiting for a writer." : "");
    strcpy(said, why);
    *cannot = !waits;
    if (!waits) return false;
    sleep_until(polygmap_mailbox_now_ns() + 50000000);
  }
  return false;
}

int main(int argc, char** argv) {
  options o = {POLYGMAP_MAILBOX_NAME, 500, 0, 100, false};
  if (!read_options(argc, argv, &o)) return 2;
  struct sigaction action = {.sa_handler = ask_to_stop};
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);

  polygmap_mailbox_reader reader = POLYGMAP_MAILBOX_READER;
  static sections s;
  char why[POLYGMAP_MAILBOX_SENTENCE];
  bool cannot = false;
  long lines = 0;
  while (attach(&reader, &o, &cannot)) {
    fprintf(stderr, "mailbox_reader: reads what process %" PRId64 " writes.\n", reader.box->header.writer_pid);
    int64_t due_ns = polygmap_mailbox_now_ns();
    polygmap_mailbox_result result = POLYGMAP_MAILBOX_OK;
    bool was_silent = false;
    while (!stop_asked && result != POLYGMAP_MAILBOX_DEAD && result != POLYGMAP_MAILBOX_CLOSED) {
      result = polygmap_mailbox_look(&reader, (int)o.silent_ms, why);
      const bool silent = result == POLYGMAP_MAILBOX_SILENT;
      if (silent && !was_silent) fprintf(stderr, "mailbox_reader: %s\n", why);
      was_silent = silent;
      const polygmap_mailbox* const box = reader.box;
      const bool whole = polygmap_mailbox_try_copy(&box->pose_lock, &box->pose, &s.pose, sizeof s.pose) &&
                         polygmap_mailbox_try_copy(&box->status_lock, &box->status, &s.status, sizeof s.status) &&
                         polygmap_mailbox_try_copy(&box->plan_lock, &box->plan, &s.plan, POLYGMAP_MAILBOX_PLAN_BYTES);
      if (result == POLYGMAP_MAILBOX_OK && whole) {
        print_line(box, &s);
        if (++lines == o.lines) stop_asked = 1;
      }
      due_ns += 1000000000 / o.rate_hz;
      if (due_ns < polygmap_mailbox_now_ns()) due_ns = polygmap_mailbox_now_ns();  // it does not catch up
      sleep_until(due_ns);
    }
    if (!stop_asked) fprintf(stderr, "mailbox_reader: %s\n", why);
    polygmap_mailbox_detach(&reader);
    if (o.once) break;
  }
  polygmap_mailbox_detach(&reader);
  return cannot ? 1 : 0;
}
