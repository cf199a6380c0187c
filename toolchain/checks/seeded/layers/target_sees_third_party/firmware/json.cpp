// SPDX-License-Identifier: Apache-2.0
// expect: nlohmann/json.hpp
#include <nlohmann/json.hpp>
