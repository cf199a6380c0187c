// SPDX-License-Identifier: Apache-2.0
// expect: <string> allocates
#include <sys/socket.h>

#include <string>
