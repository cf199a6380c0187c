// SPDX-License-Identifier: Apache-2.0
// What a real depth camera does beside noise: frames that come late or never, edges that grow, pixels without depth.
#pragma once

#include <array>

namespace polygmap::sim {

struct CameraErrors {
  double drop_share = 0.0;
  double latency_s = 0.0;
  double stamp_s = 0.0;
  double jitter_s = 0.0;
  double reorder_share = 0.0;
  double scan_s = 0.0;
  double focal_share = 0.0;
  std::array<double, 2> centre_px{};
  double edge_fattening_px = 0.0;
  double dark_share = 0.0;
  double shiny_share = 0.0;
  double hole_treads = 1.0;
  double nosing_strip_m = 0.0;
  double sun_patch_m = 0.0;

  static void visit(auto& p, auto& field) {
    field("drop_share", p.drop_share, 0.0, 0.95, "Share of the frames that never come.");
    field("latency_s", p.latency_s, -0.01, 0.3, "By which every frame comes later than after 30 ms.");
    field("stamp_s", p.stamp_s, -0.05, 0.05, "By which a frame's stamp is later than the middle of its exposure.");
    field("jitter_s", p.jitter_s, 0.0, 0.2, "By up to which a frame comes later still, evenly.");
    field("reorder_share", p.reorder_share, 0.0, 0.95, "Share of the frames that come after their successor.");
    field("scan_s", p.scan_s, -0.01, 0.03, "By which a frame takes longer than --scan-ms.");
    field("focal_share", p.focal_share, -0.05, 0.05,
          "By which the focal length is larger than the camera file has it.");
    field("centre_px", p.centre_px, -20.0, 20.0, "By which the optical centre lies farther right and down.");
    field("edge_fattening_px", p.edge_fattening_px, 0.0, 10.0, "By which what is near covers what is behind it.");
    field("dark_share", p.dark_share, 0.0, 1.0, "Share of a dark tread's pixels without depth, others in every frame.");
    field("shiny_share", p.shiny_share, 0.0, 1.0, "Share of a shiny tread that never has depth.");
    field("hole_treads", p.hole_treads, 0.0, 1.0, "Share of the treads that are dark and shiny.");
    field("nosing_strip_m", p.nosing_strip_m, 0.0, 0.1, "Width of a strip without depth along every nosing.");
    field("sun_patch_m", p.sun_patch_m, 0.0, 1.0, "Radius of a patch of sunlight on the lower treads, without depth.");
  }
};

}  // namespace polygmap::sim
