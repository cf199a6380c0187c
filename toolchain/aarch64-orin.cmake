# SPDX-License-Identifier: Apache-2.0
# Orin-class AArch64 Linux from an x86 Debian 12; the tests run under qemu-user.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CXX_FLAGS_INIT "-mcpu=cortex-a78ae")
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
# Without -L: with it threaded programs hang. And never without a time limit.
set(CMAKE_CROSSCOMPILING_EMULATOR "timeout;--kill-after=5;540;qemu-aarch64")
