// SPDX-License-Identifier: Apache-2.0
// A plugin of qemu-user: instructions of pieces of work, exact. The program marks where a piece begins and ends with a
// system call that no kernel has: number 77777, arguments (0) and (1, label, units). At the end of every piece a line
// "label units instructions" goes to the file of the argument out=FILE. Debian ships no header of the plugin interface
// (QEMU 7.2, docs/devel/tcg-plugins.rst); these are its declarations.
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
typedef void (*tb_callback)(qemu_plugin_id_t, struct qemu_plugin_tb*);
typedef void (*syscall_callback)(qemu_plugin_id_t, unsigned, int64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t,
                                 uint64_t, uint64_t, uint64_t);
typedef void (*exit_callback)(qemu_plugin_id_t, void*);
extern void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t, tb_callback);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb*);
extern void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb*, int operation, void* counter, uint64_t by);
extern void qemu_plugin_register_vcpu_syscall_cb(qemu_plugin_id_t, syscall_callback);
extern void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, exit_callback, void*);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

enum { kMarker = 77777, kAdd = 0 };
static uint64_t instructions, begun;
static FILE* out;

static void on_translation(qemu_plugin_id_t id, struct qemu_plugin_tb* block) {
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_inline(block, kAdd, &instructions, qemu_plugin_tb_n_insns(block));
}

static void on_system_call(qemu_plugin_id_t id, unsigned cpu, int64_t number, uint64_t ends, uint64_t label,
                           uint64_t units, uint64_t a4, uint64_t a5, uint64_t a6, uint64_t a7, uint64_t a8) {
  (void)id, (void)cpu, (void)a4, (void)a5, (void)a6, (void)a7, (void)a8;
  if (number != kMarker) return;
  if (ends)
    fprintf(out, "%" PRIu64 " %" PRId64 " %" PRIu64 "\n", label, (int64_t)units, instructions - begun);
  else
    begun = instructions;
}

static void on_exit_of_program(qemu_plugin_id_t id, void* unused) {
  (void)id, (void)unused;
  fclose(out);
}

__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id, const void* info, int count,
                                                               char** arguments) {
  (void)info;
  for (int i = 0; i < count; ++i) {
    if (strncmp(arguments[i], "out=", 4) == 0) out = fopen(arguments[i] + 4, "w");
  }
  if (out == NULL) return 1;
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
  qemu_plugin_register_vcpu_syscall_cb(id, on_system_call);
  qemu_plugin_register_atexit_cb(id, on_exit_of_program, NULL);
  return 0;
}
