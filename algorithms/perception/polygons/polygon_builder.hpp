// SPDX-License-Identifier: Apache-2.0
// From a surface's outline in the picture to its polygon on the plane: cut where lines and neighbours say it ends,
// every edge judged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/polygons/column_outline.hpp"
#include "algorithms/perception/polygons/convex_outline.hpp"
#include "algorithms/perception/polygons/pixel_cover.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

struct SurfaceLines {  // each only if valid
  EdgeLine nosing;
  EdgeLine back;
  bool back_drops = false;  // a lower surface lies beyond it
  EdgeLine occluder;        // where a nearer surface hides the rest: cuts the polygon, but is no end of it
};

struct PlaneSide {  // inward . (p - point) >= 0
  Vec2 point = Vec2::Zero(), inward = Vec2::UnitX();
};
// Coordinates on a plane, in m.
struct PlaneAxes {
  Vec3 origin_m = Vec3::Zero(), x = Vec3::UnitX(), y = Vec3::UnitY(), normal = Vec3::UnitZ();
  [[nodiscard]] Vec2 to_plane(const Vec3& p_m) const noexcept {
    return {(p_m - origin_m).dot(x), (p_m - origin_m).dot(y)};
  }
  [[nodiscard]] Vec3 to_space(const Vec2& p_m) const noexcept { return origin_m + p_m.x() * x + p_m.y() * y; }
  // The positive side of a line in the picture, where line . ray = 0.
  [[nodiscard]] PlaneSide side_of(const Vec3& line) const noexcept;
};

class PolygonBuilder {
 public:
  struct Params {
    double snap_m = 0.015;
    double probe_px = 3.0;
    double apart_m = 0.04;
    double goes_on_m = 0.01;
    double most_foreign = 0.05;
    std::int32_t min_tread_columns = 3;
    std::int32_t probes = 5;
    std::int32_t tread_probe_px = 6;
    double min_tread_sin = 0.5;
    double on_line_m = 0.002;
    std::int32_t min_foreign = 4;
    std::int32_t min_own = 6;
    PixelCover::Params cover;

    static void visit(auto& p, auto& field) {
      field("snap_m", p.snap_m, 0.0, 0.1, "Corners as close to a nosing or back line go onto it.");
      field("probe_px", p.probe_px, 0.0, 20.0,
            "A polygon's end is judged as many pixels of half resolution outside its edge.");
      field("apart_m", p.apart_m, 0.001, 0.5, "What is seen as far in front of a plane hides it.");
      field(
          "goes_on_m", p.goes_on_m, 0.0, 0.1,
          "A surface's own pixel outside its polygon, seen as near to the plane, says that the surface goes on there.");
      field("most_foreign", p.most_foreign, 0.0, 1.0,
            "A polygon of which a larger share of pixels is another plane's is cut back.");
      field("min_tread_columns", p.min_tread_columns, 1, 80, "A tread that ends a riser has as many columns.");
      field("probes", p.probes, 1, 10, "A polygon's edge is judged in as many places.");
      field("tread_probe_px", p.tread_probe_px, 1, 64,
            "A tread that ends a riser is looked for as many rows beyond the riser's end.");
      field("min_tread_sin", p.min_tread_sin, 0.0, 0.99,
            "A tread that ends a riser is turned against it by an angle of a larger sine.");
      field("on_line_m", p.on_line_m, 0.0, 0.05, "A polygon's edge that is nearer to a line lies on it.");
      field("min_foreign", p.min_foreign, 1, 800,
            "A polygon is cut back when as many pixels of the grid of 800 are another surface's.");
      field("min_own", p.min_own, 1, 800,
            "A piece that is cut off is kept when as many pixels of that grid are its own.");
      field("cover", p.cover);
    }
  };
  void configure(const Params& params) noexcept { params_ = params; }

  struct Built {
    std::size_t pieces = 0, without_room = 0;
  };
  // Adds the patches of regions[id]: convex pieces of one plane, the first with the surface's lines, another one with
  // those that bound it. None when the outline encloses no area. All is read until done.
  void begin(const FrameImage& picture, const Regions& regions, RegionId id, const Outline2& outline,
             const SurfaceLines& lines, SurfacePatches& patches) noexcept;
  // A piece of the work; true when all is done.
  [[nodiscard]] bool step() noexcept;
  [[nodiscard]] const Built& built() const noexcept { return built_; }
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  enum class Part : std::uint8_t { kLines, kPieces, kBeginCut, kTryCut, kCut, kPatches, kDone };
  static constexpr std::size_t kMaxPieces = 5, kMaxCuts = 4;
  struct Piece {
    Outline2 flat;                            // on the plane
    StaticVector<PlaneSide, kMaxCuts> cuts;   // that rid it of what is not its own
    std::optional<PixelCover::Count> pixels;  // below it, where they are counted
  };
  using Pieces = StaticVector<Piece, kMaxPieces>;

  [[nodiscard]] const Region& own() const noexcept { return (*regions_)[id_]; }
  [[nodiscard]] PixelCover cover() noexcept {
    return {params_.cover, *picture_, *regions_, id_, params_.apart_m, work_};
  }
  [[nodiscard]] static PlaneAxes axes_of(const Region& own, const SurfaceLines& lines) noexcept;
  [[nodiscard]] Outline2 seen_of(const Outline2& flat) noexcept;
  [[nodiscard]] bool try_cut_at_line(const EdgeLine& edge) noexcept;
  void cut_at_treads(Outline2& flat) noexcept;
  [[nodiscard]] bool try_split_off(const Piece& from, const PlaneSide& side) noexcept;
  // One piece's pixels, and whether it is to be cut.
  void count_piece() noexcept;
  void cut_piece() noexcept;
  void leave_piece(bool keep) noexcept;
  void add_patch() noexcept;
  // Nothing where the piece has no area.
  [[nodiscard]] std::optional<SurfacePatch> patch_of(Piece& piece) noexcept;
  // By its column and its row in the whole picture.
  [[nodiscard]] bool is_own(std::int32_t column, std::int32_t row) const noexcept;
  void judge_edges(const Piece& piece, SurfacePatch& patch) noexcept;
  // The tread that most columns of the surface show right below (or above) it in the picture.
  [[nodiscard]] RegionId tread_beside(bool below) noexcept;
  // All in half-resolution pixels: the edge's ends, a point of the surface.
  [[nodiscard]] EdgeKind judge_edge(const Vec2& a, const Vec2& b, const Vec2& inside) noexcept;

  Params params_;
  const FrameImage* picture_ = nullptr;
  const Regions* regions_ = nullptr;
  RegionId id_ = kNoRegion;
  const Outline2* outline_ = nullptr;  // the surface in the picture
  const SurfaceLines* lines_ = nullptr;
  SurfacePatches* patches_ = nullptr;
  PlaneAxes axes_;
  Pieces pieces_;
  Part part_ = Part::kDone;
  std::size_t next_ = 0;  // line, or piece
  Outline2 seen_;         // of the piece that is being cut
  PixelCover::Cut cut_;
  Built built_;
  WorkCount work_;
};

}  // namespace polygmap
