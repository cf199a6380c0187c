// SPDX-License-Identifier: Apache-2.0
// expect: readability-identifier-naming
struct camera_model {};
camera_model CarelessName() noexcept { return {}; }
