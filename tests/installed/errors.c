// SPDX-License-Identifier: Apache-2.0
// Every named error, provoked.
#include <polygmap.h>
#include <stdalign.h>
#include <stdio.h>
#include <string.h>

static alignas(POLYGMAP_ALIGNMENT) unsigned char memory[POLYGMAP_MEMORY_BYTES + POLYGMAP_ALIGNMENT];
static alignas(POLYGMAP_ALIGNMENT) unsigned char nothing[POLYGMAP_MEMORY_BYTES];
static uint16_t pixels[640 * 480];
static polygmap_plan plan = {sizeof plan};
static int failed;

#define EXPECT(expected, call)                                                                               \
  do {                                                                                                       \
    const int got = (call);                                                                                  \
    if (got != (expected)) {                                                                                 \
      printf("line %d: %s is %d (%s), not %s\n", __LINE__, #call, got, polygmap_error_text(got), #expected); \
      failed = 1;                                                                                            \
    }                                                                                                        \
  } while (0)
#define EXPECT_TRUE(condition)                               \
  do {                                                       \
    if (!(condition)) {                                      \
      printf("line %d: not so: %s\n", __LINE__, #condition); \
      failed = 1;                                            \
    }                                                        \
  } while (0)

static void create(void) {
  polygmap* made = (polygmap*)memory;
  EXPECT(POLYGMAP_E_NULL, polygmap_create(NULL, memory, sizeof memory, NULL));
  EXPECT(POLYGMAP_E_NULL, polygmap_create(&made, NULL, sizeof memory, NULL));
  EXPECT_TRUE(made == NULL);
  EXPECT(POLYGMAP_E_ALIGNMENT, polygmap_create(&made, memory + 8, sizeof memory - 8, NULL));
  EXPECT(POLYGMAP_E_MEMORY, polygmap_create(&made, memory, polygmap_memory_size() - 1, NULL));
  EXPECT(POLYGMAP_E_MEMORY, polygmap_create(&made, memory, 0, NULL));
  EXPECT(POLYGMAP_OK, polygmap_create(&made, memory, polygmap_memory_size(), NULL));
  EXPECT_TRUE(made != NULL);
  EXPECT_TRUE(strcmp(polygmap_create_error(memory), "") == 0);
  EXPECT(POLYGMAP_E_CONFIG, polygmap_create(&made, memory, sizeof memory, "[gait.planner]\nstand_off_m = far\n"));
  EXPECT_TRUE(made == NULL);
  EXPECT_TRUE(strstr(polygmap_create_error(memory), "line 2: gait.planner.stand_off_m ") != NULL);
  EXPECT_TRUE(strcmp(polygmap_create_error(NULL), "") == 0);
  EXPECT_TRUE(polygmap_memory_size() <= POLYGMAP_MEMORY_BYTES);
}

// A struct that is too old, too new or was never told its size.
#define EXPECT_SIZES(call, value)       \
  do {                                  \
    const uint32_t size = (value).size; \
    (value).size = 0;                   \
    EXPECT(POLYGMAP_E_SIZE, call);      \
    (value).size = size - 1;            \
    EXPECT(POLYGMAP_E_SIZE, call);      \
    (value).size = size + 8;            \
    EXPECT(POLYGMAP_E_SIZE, call);      \
    (value).size = size;                \
  } while (0)

static void push(polygmap* instance) {
  polygmap_imu imu = {sizeof imu};
  polygmap_joints joints = {sizeof joints};
  polygmap_lio lio = {sizeof lio};
  polygmap_depth depth = {sizeof depth};
  depth.width_px = 640;
  depth.height_px = 480;
  depth.pixels = pixels;

  EXPECT(POLYGMAP_E_NULL, polygmap_push_imu(NULL, &imu));
  EXPECT(POLYGMAP_E_NULL, polygmap_push_imu(instance, NULL));
  EXPECT(POLYGMAP_E_NULL, polygmap_push_joints(instance, NULL));
  EXPECT(POLYGMAP_E_NULL, polygmap_push_lio(instance, NULL));
  EXPECT(POLYGMAP_E_NULL, polygmap_push_depth(instance, NULL));
  EXPECT(POLYGMAP_E_INSTANCE, polygmap_push_imu((polygmap*)nothing, &imu));
  EXPECT_SIZES(polygmap_push_imu(instance, &imu), imu);
  EXPECT_SIZES(polygmap_push_joints(instance, &joints), joints);
  EXPECT_SIZES(polygmap_push_lio(instance, &lio), lio);
  EXPECT_SIZES(polygmap_push_depth(instance, &depth), depth);

  // Stamps of one kind increase; zero and before it are stamps like others.
  imu.stamp_ns = joints.stamp_ns = lio.stamp_ns = depth.stamp_ns = -5;
  EXPECT(POLYGMAP_OK, polygmap_push_imu(instance, &imu));
  EXPECT(POLYGMAP_OK, polygmap_push_joints(instance, &joints));
  EXPECT(POLYGMAP_OK, polygmap_push_lio(instance, &lio));
  EXPECT(POLYGMAP_OK, polygmap_push_depth(instance, &depth));
  EXPECT(POLYGMAP_E_STAMP, polygmap_push_imu(instance, &imu));
  imu.stamp_ns = joints.stamp_ns = lio.stamp_ns = depth.stamp_ns = -6;
  EXPECT(POLYGMAP_E_STAMP, polygmap_push_imu(instance, &imu));
  EXPECT(POLYGMAP_E_STAMP, polygmap_push_joints(instance, &joints));
  EXPECT(POLYGMAP_E_STAMP, polygmap_push_lio(instance, &lio));
  EXPECT(POLYGMAP_E_STAMP, polygmap_push_depth(instance, &depth));

  depth.stamp_ns = 10;
  depth.pixels = NULL;
  EXPECT(POLYGMAP_E_NULL, polygmap_push_depth(instance, &depth));
  depth.pixels = pixels;
  depth.width_px = 320;
  EXPECT(POLYGMAP_E_PICTURE, polygmap_push_depth(instance, &depth));
  depth.width_px = 640;
  EXPECT(POLYGMAP_OK, polygmap_push_depth(instance, &depth));
}

static void step(polygmap* instance) {
  polygmap_imu imu = {sizeof imu};
  EXPECT(POLYGMAP_E_NULL, polygmap_step(NULL, 0));
  EXPECT(POLYGMAP_E_INSTANCE, polygmap_step((polygmap*)nothing, 0));
  EXPECT(POLYGMAP_OK, polygmap_step(instance, 0));
  EXPECT(POLYGMAP_E_STAMP, polygmap_step(instance, 0));
  EXPECT(POLYGMAP_E_STAMP, polygmap_step(instance, -2000000));
  EXPECT(POLYGMAP_E_STAMP, polygmap_step(instance, INT64_MAX));
  EXPECT(POLYGMAP_OK, polygmap_step(instance, 1000000));  // between two cycles
  EXPECT(POLYGMAP_OK, polygmap_step(instance, 2000000));
  imu.stamp_ns = 2000000 + 1000000001;  // of another clock
  EXPECT(POLYGMAP_E_STAMP, polygmap_push_imu(instance, &imu));
  imu.stamp_ns = INT64_MAX;
  EXPECT(POLYGMAP_E_STAMP, polygmap_push_imu(instance, &imu));
  imu.stamp_ns = 2000000;
  EXPECT(POLYGMAP_OK, polygmap_push_imu(instance, &imu));
}

static void operate(polygmap* instance) {
  EXPECT(POLYGMAP_E_NULL, polygmap_operate(NULL, POLYGMAP_OPERATE_ARM));
  EXPECT(POLYGMAP_E_OPERATE, polygmap_operate(instance, 0));
  EXPECT(POLYGMAP_E_OPERATE, polygmap_operate(instance, 8));
  for (int i = 0; i < 8; ++i) EXPECT(POLYGMAP_OK, polygmap_operate(instance, POLYGMAP_OPERATE_RESUME));
  EXPECT(POLYGMAP_E_FULL, polygmap_operate(instance, POLYGMAP_OPERATE_RESUME));
  polygmap_status status = {sizeof status};
  EXPECT(POLYGMAP_OK, polygmap_step(instance, 4000000));
  EXPECT(POLYGMAP_OK, polygmap_read_status(instance, &status));
  EXPECT_TRUE(status.answer.answered == 1 && status.answer.operation == POLYGMAP_OPERATE_RESUME);
  EXPECT_TRUE(status.answer.refusal != 0);  // a module that arms does not resume
}

static void read(polygmap* instance, polygmap* unstepped) {
  polygmap_command command = {sizeof command};
  polygmap_pose pose = {sizeof pose};
  polygmap_status status = {sizeof status};
  polygmap_faults faults = {sizeof faults};
  EXPECT(POLYGMAP_E_NULL, polygmap_read_command(NULL, &command));
  EXPECT(POLYGMAP_E_NULL, polygmap_read_command(instance, NULL));
  EXPECT(POLYGMAP_E_INSTANCE, polygmap_read_command((polygmap*)nothing, &command));
  EXPECT_SIZES(polygmap_read_command(instance, &command), command);
  EXPECT_SIZES(polygmap_read_pose(instance, &pose), pose);
  EXPECT_SIZES(polygmap_read_status(instance, &status), status);
  EXPECT_SIZES(polygmap_read_faults(instance, &faults), faults);
  EXPECT_SIZES(polygmap_read_plan(instance, &plan), plan);
  EXPECT(POLYGMAP_E_NONE, polygmap_read_command(unstepped, &command));
  EXPECT(POLYGMAP_E_NONE, polygmap_read_pose(unstepped, &pose));
  EXPECT(POLYGMAP_E_NONE, polygmap_read_plan(unstepped, &plan));
  EXPECT(POLYGMAP_OK, polygmap_read_status(unstepped, &status));
  EXPECT(POLYGMAP_OK, polygmap_read_faults(instance, &faults));
  EXPECT(POLYGMAP_OK, polygmap_read_plan(instance, &plan));
  EXPECT_TRUE(faults.count > 0 && strcmp(polygmap_fault_name(faults.fault[0].number), "unknown") != 0);
  EXPECT_TRUE(strcmp(polygmap_fault_name(-1), "unknown") == 0 && strcmp(polygmap_state_name(99), "unknown") == 0);
  EXPECT_TRUE(strcmp(polygmap_joint_name(3), "left_knee") == 0);
}

static void destroyed(polygmap* instance) {
  polygmap_status status = {sizeof status};
  polygmap_destroy(NULL);
  polygmap_destroy(instance);
  polygmap_destroy(instance);
  EXPECT(POLYGMAP_E_INSTANCE, polygmap_step(instance, 6000000));
  EXPECT(POLYGMAP_E_INSTANCE, polygmap_read_status(instance, &status));
}

static void texts(void) {
  for (int a = POLYGMAP_E_NONE; a <= POLYGMAP_OK; ++a) {
    for (int b = POLYGMAP_E_NONE; b < a; ++b) {
      EXPECT_TRUE(strcmp(polygmap_error_text(a), polygmap_error_text(b)) != 0);
    }
    EXPECT_TRUE(strcmp(polygmap_error_text(a), polygmap_error_text(1)) != 0);
  }
  EXPECT_TRUE(strcmp(polygmap_version(), POLYGMAP_VERSION_TEXT) == 0);
}

static void rotation(void) {
  const double turned[4] = {2.0, 0.0, 0.0, 2.0}, none[4] = {0.0, 0.0, 0.0, 0.0};
  double R[9] = {0};
  EXPECT(POLYGMAP_E_NULL, polygmap_rotation_of(NULL, R));
  EXPECT(POLYGMAP_E_NONE, polygmap_rotation_of(none, R));
  EXPECT(POLYGMAP_OK, polygmap_rotation_of(turned, R));  // by 90 degrees about z
  EXPECT_TRUE(R[3] > 0.999 && R[1] < -0.999 && R[8] > 0.999 && R[0] < 0.001);
}

int main(void) {
  polygmap *instance = NULL, *unstepped = NULL;
  static alignas(POLYGMAP_ALIGNMENT) unsigned char more[POLYGMAP_MEMORY_BYTES];
  create();
  EXPECT(POLYGMAP_OK, polygmap_create(&instance, memory, sizeof memory, NULL));
  EXPECT(POLYGMAP_OK, polygmap_create(&unstepped, more, sizeof more, NULL));
  push(instance);
  step(instance);
  operate(instance);
  read(instance, unstepped);
  destroyed(instance);
  texts();
  rotation();
  if (!failed) puts("every error has its name");
  return failed;
}
