// SPDX-License-Identifier: Apache-2.0
// A controller that is loaded as a shared object has the module in it.
#include <polygmap.h>

int plugin_load(void* memory, size_t bytes);
int plugin_load(void* memory, size_t bytes) {
  polygmap* instance;
  return polygmap_create(&instance, memory, bytes, NULL);
}
