// SPDX-License-Identifier: Apache-2.0
// First stage of a frame: raw depths -> columns of eight pixels without the robot's own body -> straight segments.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_noise_model.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/image/self_filter.hpp"
#include "algorithms/perception/segments/scanline_segments.hpp"

namespace polygmap {

class Segmenter {
 public:
  // What the next step begins with; a benchmark charges time to it.
  enum class Part : std::uint8_t { kMask, kRows, kDone };

  // raw and body are read until the stage is done. body: in the camera frame at the exposure.
  void begin(const ScanlineSegmentation::Params& params, const DepthNoiseModel& noise, const RawImage& raw,
             const std::array<LegShapes, kFootCount>& body, const BodyMargin& margin) noexcept;
  Progress step(WorkBudget& budget) noexcept;
  [[nodiscard]] Part part() const noexcept { return part_; }

  [[nodiscard]] const FrameImage& image() const noexcept { return image_; }
  // Writable: whoever gives a segment to a plane writes the plane into it.
  [[nodiscard]] ScanlineSegmentation::Columns& segments() noexcept { return segmentation_.columns(); }
  [[nodiscard]] bool blank() const noexcept { return measured_px_ == 0; }
  // Share of the picture outside the robot's own body.
  [[nodiscard]] double invalid_fraction() const noexcept;
  // Segments that found no room.
  [[nodiscard]] std::uint32_t overflow() const noexcept { return segmentation_.overflow(); }

 private:
  std::int32_t do_piece() noexcept;  // returns its units
  void reduce_row() noexcept;

  Part part_ = Part::kDone;
  const RawImage* raw_ = nullptr;
  const std::array<LegShapes, kFootCount>* body_ = nullptr;
  BodyMargin margin_;
  std::size_t shape_ = 0;
  std::int32_t row_ = 0;
  std::int32_t measured_px_ = 0;
  std::int32_t outside_body_px_ = 0;
  SelfFilter self_filter_;
  ScanlineSegmentation segmentation_;
  FrameImage image_;
};

}  // namespace polygmap
