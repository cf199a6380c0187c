// SPDX-License-Identifier: Apache-2.0
// Parameters from a TOML file: what it names is changed, all else stays. The tables are those of the structs.
#pragma once

#include <string>
#include <string_view>

#include "firmware/config/file_error.hpp"
#include "firmware/config/param_table.hpp"

namespace polygmap::config {

// Throws FileError, one sentence that names file, line and key; what the table points into may be half changed then.
void read_params(const std::string& path, const ParamTable& table);
void parse_params(const FileName& name, std::string_view text, const ParamTable& table);

template <class T>
void read_params(const std::string& path, T& params) {
  T read = params;
  read_params(path, param_table(read));
  params = read;
}

}  // namespace polygmap::config
