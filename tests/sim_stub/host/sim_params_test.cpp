// SPDX-License-Identifier: Apache-2.0
// `polygmap params`, and --params of the commands that run the module.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "firmware/config/param_file.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/params_command.hpp"

namespace polygmap::sim {
namespace {

struct ToolCall {
  int code = -1;
  std::string out, err;
};
ToolCall call_tool(const std::vector<std::string>& arguments) {
  std::ostringstream out, err;
  const int code = polygmap_main(arguments, run_climb, out, err, false);
  return {code, out.str(), err.str()};
}

std::string write(const std::string& text) {
  const std::string path = testing::TempDir() + "polygmap_params_command_" +
                           testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml";
  std::ofstream(path) << text;
  return path;
}

TEST(ParamsCommand, List_ReadsBackToTheLastBit) {
  const ToolCall listed = call_tool({"params", "list"});
  EXPECT_EQ(listed.code, kExitPass);
  Params params;
  params.estimator.fusion.tau_s = 0.1;  // the file must bring it back
  config::read_params(write(listed.out), params);
  EXPECT_EQ(config::hash_of(params), config::hash_of(Params{}));
  EXPECT_EQ(listed.out.find("# Parameters, hash " + config::hash_of(params)), 0U);
}

TEST(ParamsCommand, ListOfAFile_ShowsItsValues) {
  const std::string file = write("estimator.fusion.tau_s = 2.5\n");
  EXPECT_NE(call_tool({"params", "list", "--params", file}).out.find("\ntau_s = 2.5  # 0 to 1000 s: "),
            std::string::npos);
  const auto json = nlohmann::json::parse(call_tool({"params", "list", "--json", "--params", file}).out);
  bool found = false;
  for (const auto& param : json.at("params")) {
    if (param.at("name") != "estimator.fusion.tau_s") continue;
    found = true;
    EXPECT_EQ(param.at("value"), 2.5);
    EXPECT_EQ(param.at("default"), 4.0);
    EXPECT_EQ(param.at("unit"), "s");
    EXPECT_EQ(param.at("max"), 1000.0);
  }
  EXPECT_TRUE(found);
}

TEST(ParamsCommand, Diff_SaysWhatIsNotTheDefault) {
  const ToolCall same = call_tool({"params", "diff", write("estimator.fusion.tau_s = 4.0\n")});
  EXPECT_EQ(same.out, "No parameter differs from its default.\n");
  const ToolCall other = call_tool({"params", "diff", write("estimator.fusion.tau_s = 2\nself_filter = false\n")});
  EXPECT_EQ(other.code, kExitPass);
  EXPECT_EQ(other.out, "self_filter = false  # default true\nestimator.fusion.tau_s = 2  # default 4\n")
      << "of a file, what stands before its tables comes first";
}

TEST(ParamsCommand, BadFile_IsOneSentenceAndExit2) {
  const std::string file = write("estimator.fusion.tau = 2\n");
  for (const std::vector<std::string>& words : {std::vector<std::string>{"params", "diff", file},
                                                {"params", "list", "--params", file},
                                                {"climb", "--params", file},
                                                {"params", "diff", "/nowhere"},
                                                {"params"},
                                                {"params", "list", "--params", ""}}) {
    const ToolCall refused = call_tool(words);
    EXPECT_EQ(refused.code, kExitUsage) << words[0];
    EXPECT_EQ(refused.out, "");
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
    EXPECT_TRUE(refused.err.starts_with("polygmap: ") && refused.err.ends_with(".\n")) << refused.err;
  }
}

TEST(ParamsCommand, WordThatIsNoCommandOfIt_IsNamedWithThoseThereAre) {
  EXPECT_EQ(
      call_tool({"params", "lst"}).err,
      "polygmap: \"lst\" is no command of params; there are list, docs, reality, states and diff; see polygmap params "
      "--help.\n");
  EXPECT_EQ(call_tool({"params", "list", "lst"}).err,
            "polygmap: \"lst\" is a word too many; see polygmap params list --help.\n");
}

TEST(ParamsCommand, CameraFileForOne_IsCalledThat) {
  const std::string file = write("width = 640\nheight = 480\nfx = 366.7\nfy = 366.7\n");
  EXPECT_NE(call_tool({"climb", "--params", file}).err.find("looks like a camera file"), std::string::npos);
}

TEST(ParamsCommand, BusFileOrPictureForOne_IsCalledThat) {
  const std::string bus = std::string(POLYGMAP_BUSES) + "/damiao.toml", picture = write("\x89PNG\r\n\x1a\n");
  EXPECT_EQ(
      call_tool({"params", "diff", bus}).err,
      "polygmap: Parameter file \"" + bus + "\" looks like a bus file (it has drives), which holds no parameters.\n");
  EXPECT_EQ(
      call_tool({"params", "diff", picture}).err,
      "polygmap: Parameter file \"" + picture + "\", line 1: it is no text, or not in UTF-8, and TOML is expected.\n");
}

TEST(ParamsCommand, Docs_NameEveryParameterWithItsRange) {
  const std::string out = call_tool({"params", "docs"}).out;
  Params params;
  const auto rows = static_cast<std::size_t>(std::count(out.begin(), out.end(), '\n'));
  EXPECT_GT(rows, config::param_table(params).params.size());
  EXPECT_NE(out.find("| `max_age_s` | 0.4 | 0 to 0.5 s | A pose is no older"), std::string::npos);
}

}  // namespace
}  // namespace polygmap::sim
