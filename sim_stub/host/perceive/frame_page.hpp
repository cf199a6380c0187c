// SPDX-License-Identifier: Apache-2.0
// One depth picture and what was found in it, as a page (host/report/page/DATA.md, "A frame").
#pragma once

#include <string>

#include "sim_stub/host/perceive/perceive.hpp"
#include "sim_stub/host/report/report_blocks.hpp"

namespace polygmap::sim {

// name: the picture's file, as shown. Throws config::FileError.
[[nodiscard]] ReportJson frame_json(const std::string& name, const config::CameraProfile& camera,
                                    const DepthPng& picture, const Perceived& perceived,
                                    const std::string& params_hash);
void write_frame_page(const std::string& path, const std::string& name, const config::CameraProfile& camera,
                      const DepthPng& picture, const Perceived& perceived, const std::string& params_hash);

}  // namespace polygmap::sim
