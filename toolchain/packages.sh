# SPDX-License-Identifier: Apache-2.0
# The Debian 12 packages, once. Sourced.

kPackagesClimb=(g++ cmake ninja-build libeigen3-dev libopencv-core-dev libopencv-imgproc-dev nlohmann-json3-dev libcli11-dev
  liblodepng-dev libzstd-dev libtomlplusplus-dev libmujoco-dev libgtest-dev)
kPackagesCheck=("${kPackagesClimb[@]}" clang-14 libclang-rt-14-dev clang-format-14 clang-tidy-14 libbenchmark-dev valgrind pkgconf
  liborocos-kdl-dev python3 python3-numpy python3-pil python3-canmatrix)
# libc6 and libstdc++6 of the target let qemu-user start the test programs.
kPackagesCross=(g++-aarch64-linux-gnu libc6:arm64 libstdc++6:arm64 libgtest-dev:arm64 qemu-user)
# What toolchain/vm boots with; the guest's own packages are downloaded and unpacked (toolchain/vm/fetch_kernel).
kPackagesVm=(qemu-system-arm python3)
# What toolchain/package makes and looks at the package with.
kPackagesPackage=(systemd dpkg-dev)
# What toolchain/report_bundle bundles the report's page with, where there is no npm yet, and what its tests open it with.
kPackagesBundle=(nodejs npm)
kPackagesPage=(chromium python3 python3-numpy python3-pil)
# What toolchain/campaign paper draws its figures with.
kPackagesFigures=(python3-matplotlib)
