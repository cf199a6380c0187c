// SPDX-License-Identifier: Apache-2.0
// What the foothold search offers and what the gait decided to do with it. World frame unless named otherwise.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/math/math.hpp"
#include "algorithms/core/messages/ground_view.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/surfaces.hpp"

namespace polygmap {

// A pose of a sole that lies on mapped polygons.
struct Foothold {
  Vec3 position_m = Vec3::Zero();  // of the sole frame's origin (below the ankle, see robot_model.hpp)
  double yaw_rad = 0.0;            // of the sole, perpendicular to the nosing
  Vec3 up = Vec3::UnitZ();         // the tread's normal
  double clearance_m = 0.0;        // signed: least distance from the contact rectangle to the polygon's edges
  double toe_clearance_m = 0.0;    // signed: collision box to the next riser; +inf when none is mapped
  std::uint32_t polygon_id = 0;
  std::int64_t last_seen_ns = 0;   // exposure of the last frame that saw the polygon
  double nosing_distance_m = 0.0;  // along the foot axis from the mapped nosing to the sole frame's origin
  // Signed: from the contact rectangle across to what is mapped of the tread on the left and on the right; +inf:
  // unknown.
  std::array<double, kFootCount> side_room_m{std::numeric_limits<double>::infinity(),
                                             std::numeric_limits<double>::infinity()};
};

// Why the climb does not go on: what the search found in the map's way, or from kLegsCannot on what the gait met.
// Anything but kNone, kTop and kAtGoal is a reason to stop.
enum class StopReason : std::uint8_t {
  kNone,
  kNothingSeen,    // no frame, no surface in it, or too little of the next tread
  kNoStaircase,    // level ground, no higher tread in the map
  kTop,            // standing on the highest tread of a staircase just climbed
  kRiseTooHigh,    // the next surface is out of reach, or the tread before it was not seen: measured_rise_m
  kTreadTooShort,  // the foot does not fit: measured_tread_m
  kTooNarrow,  // both feet do not fit side by side between the sides that were seen, or what lies there is no stairs
  kMapStale,   // the newest fused frame is too old
  kEdgeUncertain,  // the foot fits the next tread, but not with its edges known so vaguely
  kObstacle,       // something stands on the next tread or before it, and both feet do not fit beside it
  // Where the search found no way, and the pictures may be why (PictureMonitor).
  kDepthMissing,   // too little of the way ahead has depth
  kDepthNoisy,     // the depths are noisier than what the parameters allow for
  kLegsCannot,     // the legs cannot do the next step: of this rise when it is a leading one, 0 otherwise
  kUnsteady,       // what the search offers keeps changing
  kNotLinedUp,     // so many steps on the floor, and it does not stand straight before the stairs
  kGroundMissing,  // no ground where the foot came down: it was put back where it had stood
  kToppling,       // one foot after the other went back to where it had stood, since the body toppled towards it
  kGroundSoft,     // its soles turned against each other where it stood
  kStateStale,     // IMU or joint feedback fell silent
  // Asked of the gait by the module, or of the module by its operator; the foot in the air comes down first.
  kOperator,
  kDriveError,       // a drive told of an error, or left its motor mode
  kTimeShort,        // control's cycles were lost or overran again and again
  kCommandsRefused,  // one command after the other was not taken by the bus, or not finite and never sent
  kDriveHot,         // a drive told that it is hotter than it may be
  kAtGoal,           // it stands where it was told to go
  kGroundEnds,       // on the way there no more level ground was seen
  kDropTooDeep,      // the surface below the edge ahead is out of reach: measured_rise_m, negative
  kNoWayUpOrDown,    // it stands below or above where it was told to go, and saw no stairs from there
  kTooSteep,         // a ramp on the way there: by what it rises over a metre
};

// One line for each reason, in the enumeration's order: a name for machines, and for people what may follow "the module
// stopped: ", without a full stop.
struct StopReasonInfo {
  std::string_view name;
  std::string_view text;
};
inline constexpr std::array kStopReasonTable{
    StopReasonInfo{"none", "it gave no reason"},
    StopReasonInfo{"nothing_seen", "it saw no surface to step on, or too little of the next one"},
    StopReasonInfo{"no_staircase", "it saw level ground and no higher tread"},
    StopReasonInfo{"top", "it took the tread it stood on for the highest"},
    StopReasonInfo{"rise_too_high", "the next surface that it saw was too high to step on"},
    StopReasonInfo{"tread_too_short", "it measured a tread too short for the foot"},
    StopReasonInfo{"too_narrow", "it measured a tread too narrow for two feet and room beside them"},
    StopReasonInfo{"map_stale", "its map was stale"},
    StopReasonInfo{"edge_uncertain", "it knew the edges of the next tread too vaguely"},
    StopReasonInfo{"obstacle", "something stood where its feet would have gone next"},
    StopReasonInfo{"depth_missing", "its camera measured no depth on too much of the way ahead"},
    StopReasonInfo{"depth_noisy", "its camera's depth was too noisy to find the next tread"},
    StopReasonInfo{"legs_cannot", "its legs could not do the next step"},
    StopReasonInfo{"unsteady", "what it saw kept changing"},
    StopReasonInfo{"not_lined_up", "it did not come to stand straight before the stairs"},
    StopReasonInfo{"ground_missing", "there was no ground where a foot came down, and it put the foot back"},
    StopReasonInfo{"toppling", "its body kept toppling towards the foot it lifted, and it put every one back"},
    StopReasonInfo{"ground_soft",
                   "its soles turned against each other where it stood, on soft ground or by play in its joints"},
    StopReasonInfo{"state_stale", "its IMU or its joints fell silent"},
    StopReasonInfo{"operator", "it was asked to"},
    StopReasonInfo{"drive_error", "a drive told of an error"},
    StopReasonInfo{"time_short", "its control cycles kept coming late"},
    StopReasonInfo{"commands_refused", "its drives could not be sent its commands"},
    StopReasonInfo{"drive_hot", "a drive was too hot"},
    StopReasonInfo{"at_goal", "it stood at its goal"},
    StopReasonInfo{"ground_ends", "it saw no more level ground on the way to its goal"},
    StopReasonInfo{"drop_too_deep", "the next surface that it saw was too far down to step on"},
    StopReasonInfo{"no_way_up_or_down", "it stands below or above where it was told to go, and saw no stairs there"},
    StopReasonInfo{"too_steep", "the ground on the way to its goal sloped too steeply to walk on"},
};
static_assert(kStopReasonTable.size() == static_cast<std::size_t>(StopReason::kTooSteep) + 1);

[[nodiscard]] constexpr std::string_view name_of(StopReason reason) noexcept {
  const auto i = static_cast<std::size_t>(reason);
  return i < kStopReasonTable.size() ? kStopReasonTable[i].name : "unknown";
}
[[nodiscard]] constexpr std::string_view text_of(StopReason reason) noexcept {
  const auto i = static_cast<std::size_t>(reason);
  return i < kStopReasonTable.size() ? kStopReasonTable[i].text : "it gave no known reason";
}

// The edge of the next tread.
struct TreadView {
  Vec3 nosing_a_m = Vec3::Zero();  // left end seen when climbing
  Vec3 nosing_b_m = Vec3::Zero();  // right end
};

// Result of one search (eqs 14-28).
struct FootholdSet {
  std::int64_t map_stamp_ns = 0;  // exposure of the newest fused frame
  Foothold p_star;                // eq. 26: on the next tread
  bool has_p_star = false;
  bool has_p_star_star = false;
  // p* spread to left and right sole, both on the same tread. Their position_m is where a foot is told to go, which is
  // back from where it will stand by FootholdSearch::Query::feet_ahead_m; all else is of where it will stand.
  std::array<Foothold, kFootCount> p_star_feet;
  std::array<Foothold, kFootCount> p_star_star_feet;  // p** likewise, on the tread after p*'s
  TreadView tread;                                    // of p*
  TreadView lip_beyond;  // down, where has_lip_beyond: p*'s tread drops away there; back as p_star_feet are
  bool has_lip_beyond = false;
  StopReason obstruction = StopReason::kNothingSeen;
  StopReason unsteady = StopReason::kUnsteady;  // why, where what is offered keeps changing
  double measured_rise_m = 0.0;                 // stance to the next tread, valid unless nothing was seen
  double measured_tread_m = 0.0;                // nosing to what rises behind it; 0: nothing is mapped there
  GroundView ground;
};

}  // namespace polygmap
