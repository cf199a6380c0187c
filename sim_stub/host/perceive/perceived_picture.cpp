// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/perceive/perceived_picture.hpp"

#include <lodepng.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "sim_stub/host/output_file.hpp"

namespace polygmap::sim {
namespace {

constexpr int kShift = 4;  // OpenCV draws in sixteenths of a pixel
constexpr double kNear_m = 0.05;
constexpr int kLegend_px = 30;

struct KindLook {
  const char* kind;
  const char* said;
  cv::Scalar rgb;
};
// Okabe and Ito's colours, which people of any colour vision tell apart; frame/kinds.js has the same.
const std::array<KindLook, 4> kKinds{{{"tread", "tread, floor", {0, 158, 115}},
                                      {"riser", "riser", {86, 180, 233}},
                                      {"other", "other", {230, 159, 0}},
                                      {"unknown", "kind unknown", {204, 121, 167}}}};
const cv::Scalar kNosing{240, 228, 66}, kDark{20, 24, 28}, kLight{255, 255, 255};

const KindLook& look_of(const Surface& surface, UpSource up) {
  const std::string kind = kind_name(surface, up);
  return *std::find_if(kKinds.begin(), kKinds.end(), [&](const KindLook& look) { return look.kind == kind; });
}

class Drawing {
 public:
  Drawing(const config::CameraProfile& camera, const DepthPng& picture, const Perceived& perceived)
      : camera_(camera),
        picture_(picture),
        perceived_(perceived),
        scale_((kLeastDrawn_px + picture.width_px - 1) / picture.width_px),
        drawn_(picture.height_px * scale_ + kLegend_px, picture.width_px * scale_, CV_8UC3, kDark) {}

  [[nodiscard]] cv::Mat take() {
    fill();
    for (const PerceivedPlane& pieces : perceived_.planes) {
      for (const Surface& s : pieces) outline(s.polygon_m);
    }
    for (const PerceivedPlane& pieces : perceived_.planes) {  // over all edges: a nosing lies on those of two surfaces
      for (const Surface& s : pieces) {
        if (s.nosing_m) line((*s.nosing_m)[0], (*s.nosing_m)[1], kNosing, 3);
      }
    }
    for (std::size_t i = 0; i < perceived_.planes.size(); ++i) {
      for (const Surface& s : perceived_.planes[i]) name(i + 1, s);
    }
    legend();
    return drawn_;
  }

 private:
  // Depth in grey under the kind's colour, and a dark seam where two planes meet.
  void fill() {
    std::vector<cv::Scalar> hues{{}};
    for (const PerceivedPlane& pieces : perceived_.planes) {
      hues.push_back(look_of(pieces.front(), perceived_.up_source).rgb);
    }
    for (int v = 0; v < picture_.height_px * scale_; ++v) {
      for (int u = 0; u < picture_.width_px * scale_; ++u) {
        const std::size_t at = index(u / scale_, v / scale_);
        const unsigned label = perceived_.labels[at];
        const double z_m = picture_.depth[at] * camera_.intrinsics.depth_unit_m;
        const double grey = picture_.depth[at] == 0 ? 0.0 : grey_of(z_m);
        auto& pixel = drawn_.at<cv::Vec3b>(v, u);
        for (int k = 0; k < 3; ++k) {
          pixel[k] = cv::saturate_cast<uchar>(label == 0 ? grey : 0.35 * grey + 0.65 * hues[label][k]);
          if (is_seam(u / scale_, v / scale_)) pixel[k] /= 3;
        }
      }
    }
  }
  // In steps, so that noise of the depth does not make the file three times as large.
  [[nodiscard]] double grey_of(double z_m) const {
    constexpr double kStep = 10.0;
    return kStep * std::round((60.0 + 140.0 * std::max(0.0, 1.0 - z_m / camera_.max_depth_m)) / kStep);
  }
  [[nodiscard]] bool is_seam(int column, int row) const {
    const auto differs = [&](int c, int r) {
      const unsigned own = perceived_.labels[index(column, row)];
      const unsigned other = c < picture_.width_px && r < picture_.height_px ? perceived_.labels[index(c, r)] : own;
      return own != 0 && other != 0 && own != other;
    };
    return differs(column + 1, row) || differs(column, row + 1);
  }
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(picture_.width_px) +
           static_cast<std::size_t>(column);
  }

  [[nodiscard]] cv::Point pixel_of(const Vec3& p) const {
    const CameraIntrinsics& k = camera_.intrinsics;
    constexpr double kFar_px = 1e5;  // OpenCV's coordinates are short
    const auto sixteenths = [&](double px) {
      return static_cast<int>(std::lround(std::clamp((px + 0.5) * scale_ - 0.5, -kFar_px, kFar_px) * (1 << kShift)));
    };
    return {sixteenths(p.x() / p.z() * k.fx_px + k.cx_px), sixteenths(p.y() / p.z() * k.fy_px + k.cy_px)};
  }
  // Only what is before the camera.
  void line(Vec3 a, Vec3 b, const cv::Scalar& colour, int width_px) {
    if (a.z() < b.z()) std::swap(a, b);
    if (a.z() < kNear_m) return;
    if (b.z() < kNear_m) b = a + (b - a) * ((a.z() - kNear_m) / (a.z() - b.z()));
    cv::line(area_, pixel_of(a), pixel_of(b), kDark, width_px + (width_px > 1 ? 4 : 2), cv::LINE_AA, kShift);
    cv::line(area_, pixel_of(a), pixel_of(b), colour, width_px, cv::LINE_AA, kShift);
  }
  void outline(const std::vector<Vec3>& corners) {
    for (std::size_t i = 0; i < corners.size(); ++i) line(corners[i], corners[(i + 1) % corners.size()], kLight, 1);
  }

  // Written where the piece has most room around, so that a leg before it or its own edge cuts no number.
  void name(std::size_t id, const Surface& piece) {
    std::vector<cv::Point> corners;
    for (const Vec3& p : piece.polygon_m) {
      if (p.z() < kNear_m) return;
      corners.push_back(pixel_of(p));
    }
    cv::Mat room = cv::Mat::zeros(picture_.height_px * scale_, picture_.width_px * scale_, CV_8U), distance_px;
    cv::fillConvexPoly(room, corners, {255}, cv::LINE_8, kShift);
    for (int v = 0; v < room.rows; ++v) {
      for (int u = 0; u < room.cols; ++u) {
        if (perceived_.labels[index(u / scale_, v / scale_)] != id) room.at<uchar>(v, u) = 0;
      }
    }
    cv::copyMakeBorder(room, room, 1, 1, 1, 1, cv::BORDER_CONSTANT, {0});  // the picture's edge is one, too
    cv::distanceTransform(room, distance_px, cv::DIST_L2, 3);
    double most_px = 0.0;
    cv::Point at;
    cv::minMaxLoc(distance_px, nullptr, &most_px, nullptr, &at);
    if (most_px < 1.0) return;  // hidden by another plane's pixels
    const std::string number = std::to_string(id), kind = look_of(piece, perceived_.up_source).kind;
    const double size = std::clamp(most_px / 24.0, 0.4, 0.8);
    const bool has_room = most_px > 20.0;  // for the kind, too
    text(number, at - cv::Point(0, has_room ? 8 : 0), size);
    if (has_room) text(kind, at + cv::Point(0, 12), 0.4);
  }
  // In the middle of at.
  void text(const std::string& words, const cv::Point& at, double size) {
    int below_px = 0;
    const cv::Size extent = cv::getTextSize(words, cv::FONT_HERSHEY_SIMPLEX, size, 1, &below_px);
    const cv::Point from(std::clamp(at.x - extent.width / 2, 2, std::max(2, drawn_.cols - extent.width - 2)),
                         std::max(at.y + extent.height / 2, extent.height + 2));
    cv::putText(drawn_, words, from, cv::FONT_HERSHEY_SIMPLEX, size, kDark, 4, cv::LINE_AA);
    cv::putText(drawn_, words, from, cv::FONT_HERSHEY_SIMPLEX, size, kLight, 1, cv::LINE_AA);
  }

  void legend() {
    const int middle = drawn_.rows - kLegend_px / 2;
    int x = 8;
    const auto entry = [&](const char* said, const cv::Scalar& rgb, int half_height) {
      cv::rectangle(drawn_, {x, middle - half_height}, {x + 14, middle + half_height}, rgb, cv::FILLED);
      int below_px = 0;
      const cv::Size extent = cv::getTextSize(said, cv::FONT_HERSHEY_SIMPLEX, 0.42, 1, &below_px);
      cv::putText(drawn_, said, {x + 20, middle + extent.height / 2}, cv::FONT_HERSHEY_SIMPLEX, 0.42, kLight, 1,
                  cv::LINE_AA);
      x += extent.width + 36;
    };
    const bool is_assumed = perceived_.up_source == UpSource::kAssumed;
    for (const KindLook& look : kKinds) {
      if ((std::string(look.kind) == "unknown") == is_assumed) entry(look.said, look.rgb, 6);
    }
    entry("nosing", kNosing, 2);
    entry("no plane", {150, 150, 150}, 6);
  }

  const config::CameraProfile& camera_;
  const DepthPng& picture_;
  const Perceived& perceived_;
  int scale_;
  cv::Mat drawn_;
  cv::Mat area_ = drawn_.rowRange(0, drawn_.rows - kLegend_px);  // of the picture; lines end there
};

}  // namespace

std::vector<unsigned char> picture_png(const config::CameraProfile& camera, const DepthPng& picture,
                                       const Perceived& perceived) {
  const cv::Mat drawn = Drawing(camera, picture, perceived).take();
  std::vector<unsigned char> bytes;
  const unsigned error = lodepng::encode(bytes, std::vector<unsigned char>(drawn.datastart, drawn.dataend),
                                         static_cast<unsigned>(drawn.cols), static_cast<unsigned>(drawn.rows), LCT_RGB);
  if (error != 0) throw config::FileError(std::string("Cannot encode the picture: ") + lodepng_error_text(error) + ".");
  return bytes;
}

void write_picture(const std::string& path, const config::CameraProfile& camera, const DepthPng& picture,
                   const Perceived& perceived) {
  const std::vector<unsigned char> bytes = picture_png(camera, picture, perceived);
  write_output(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace polygmap::sim
