// SPDX-License-Identifier: Apache-2.0
// polygmap.h for the module's own files: there `polygmap` is a namespace, and no type can have its name.
#pragma once

#define polygmap polygmap_handle
#include "firmware/link/polygmap.h"
#undef polygmap
