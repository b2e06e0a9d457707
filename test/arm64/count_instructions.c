/* A plugin of qemu's (version 1 of their interface, qemu 4.2 to 8): prints how many instructions a program executed. The
   interface's header is not packaged, hence these declarations. For one thread. */
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef uint64_t Id;
struct Block;
extern void qemu_plugin_register_vcpu_tb_trans_cb(Id id, void (*callback)(Id id, struct Block* block));
extern void qemu_plugin_register_vcpu_tb_exec_inline(struct Block* block, int add, void* counter, uint64_t number);
extern size_t qemu_plugin_tb_n_insns(const struct Block* block);
extern void qemu_plugin_register_atexit_cb(Id id, void (*callback)(Id id, void* data), void* data);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;
static uint64_t executed;

static void count_block(Id id, struct Block* block) {
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_inline(block, 0, &executed, qemu_plugin_tb_n_insns(block));
}

static void print(Id id, void* data) {
  (void)id, (void)data;
  fprintf(stderr, "instructions %" PRIu64 "\n", executed);
}

__attribute__((visibility("default"))) int qemu_plugin_install(Id id, const void* info, int argc, char** argv) {
  (void)info, (void)argc, (void)argv;
  qemu_plugin_register_vcpu_tb_trans_cb(id, count_block);
  qemu_plugin_register_atexit_cb(id, print, NULL);
  return 0;
}
