// SPDX-License-Identifier: Apache-2.0
// render_pictures SEED STEPS REQUESTS PICTURES: renders on the host what the robot in the guest asks for
// (picture_request.hpp), until nobody has the named pipe REQUESTS open any more.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "sim_stub/nominal_robot.hpp"
#include "tests/vm/picture_request.hpp"

namespace polygmap::vm {
namespace {

class Renderer {
 public:
  explicit Renderer(const sim::SimOptions& options)
      : robot_(options),
        solids_(sim::solids_of(robot_.stairs())),
        renderer_(robot_.depth_camera().intrinsics()),
        noise_({.scale = robot_.errors().depth_scale, .strength = sim::ErrorParams{}.depth_noise},
               robot_.depth_camera().intrinsics(), options.seed),
        pixels_(static_cast<std::size_t>(renderer_.intrinsics().width_px) *
                static_cast<std::size_t>(renderer_.intrinsics().height_px)) {}

  [[nodiscard]] const std::vector<std::uint16_t>& render(const PictureRequest& request) {
    renderer_.render(scene(request.first), scene(request.last));
    noise_.apply(renderer_, request.number, request.exposed_s, pixels_.data());
    return pixels_;
  }

 private:
  [[nodiscard]] sim::DepthScene scene(const PictureMoment& moment) const {
    const sim::RobotErrors& errors = robot_.errors();
    sim::DepthScene scene{moment.true_T_base() * errors.base_T_camera, solids_, {}, errors.base_T_camera, true};
    const JointVector q_rad = JointVector::Map(moment.q_rad.data());
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      RobotModel robot = sim::nominal_robot();
      robot.legs = errors.legs[index_of(foot)];
      scene.base_legs[index_of(foot)] = base_leg_shapes(robot, foot, leg_joints(q_rad, foot));
    }
    return scene;
  }

  sim::SimRobot robot_;  // its stairs and errors; it never moves
  std::vector<sim::SolidBox> solids_;
  sim::DepthRenderer renderer_;
  sim::CameraNoise noise_;
  std::vector<std::uint16_t> pixels_;
};

int serve(const sim::SimOptions& options, const char* requests_path, const char* pictures_path) {
  Renderer renderer(options);
  // Opening a named pipe waits for its other end: the guest opens them in the same order.
  std::ifstream requests(requests_path, std::ios::binary);
  std::ofstream pictures(pictures_path, std::ios::binary);
  PictureRequest request;
  while (requests.read(reinterpret_cast<char*>(&request), sizeof request)) {
    const std::vector<std::uint16_t>& pixels = renderer.render(request);
    pictures.write(reinterpret_cast<const char*>(pixels.data()),
                   static_cast<std::streamsize>(pixels.size() * sizeof(std::uint16_t)));
    if (!pictures.flush()) return std::fprintf(stderr, "render_pictures: cannot write %s\n", pictures_path), 1;
  }
  return 0;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) {
  if (argc != 5) return std::puts("render_pictures SEED STEPS REQUESTS PICTURES"), 2;
  return polygmap::vm::serve(polygmap::vm::sim_options(std::strtoull(argv[1], nullptr, 10), std::atoi(argv[2])),
                             argv[3], argv[4]);
}
