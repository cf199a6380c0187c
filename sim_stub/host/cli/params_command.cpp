// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/params_command.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <ostream>
#include <utility>

#include "firmware/config/param_file.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/command_words.hpp"
#include "sim_stub/reality.hpp"

namespace polygmap::sim {
namespace {

using config::EnumValue;
using config::Param;
using config::RotationValue;
using Json = nlohmann::ordered_json;

// gait.planner and stand_off_m.
std::pair<std::string, std::string> table_and_key(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos) return {"", name};
  return {name.substr(0, dot), name.substr(dot + 1)};
}

std::string unit(const Param& param) { return std::string(config::unit_of(param.name)); }

// "0 to 1 m", "true or false", "ds or ss".
std::string range(const Param& param) {
  if (std::holds_alternative<bool*>(param.value)) return "true or false";
  if (const auto* choice = std::get_if<EnumValue>(&param.value)) {
    std::string all;
    for (const std::string_view name : choice->names) all += (all.empty() ? "" : " or ") + std::string(name);
    return all;
  }
  return config::text_of(param.least) + " to " + config::text_of(param.most) +
         (unit(param).empty() ? "" : " " + unit(param));
}

Json value(const Param& param) {
  const std::string text = config::text_of(param);
  return Json::parse(text);  // what TOML has for these is JSON, too
}

}  // namespace

std::string params_toml(const Params& params) {
  Params copy = params;
  std::string out = "# Parameters, hash " + config::hash_of(params) + "\n", last_table;
  for (const Param& param : config::param_table(copy).params) {
    const auto [table, key] = table_and_key(param.name);
    if (table != last_table) out += "\n[" + (last_table = table) + "]\n";
    out += key + " = " + config::text_of(param) + "  # " + range(param) + ": " + std::string(param.text) + "\n";
  }
  return out;
}

std::string params_json(const Params& params) {
  Params copy = params, defaults;
  const config::ParamTable table = config::param_table(copy), usual = config::param_table(defaults);
  Json list = Json::array();
  for (std::size_t i = 0; i < table.params.size(); ++i) {
    const Param& param = table.params[i];
    Json one{{"name", param.name}, {"value", value(param)}, {"default", value(usual.params[i])}};
    if (const auto* choice = std::get_if<EnumValue>(&param.value)) {
      one["choices"] = choice->names;
    } else if (!std::holds_alternative<bool*>(param.value)) {
      one["min"] = param.least;
      one["max"] = param.most;
      one["unit"] = unit(param);
    }
    one["text"] = param.text;
    list.push_back(std::move(one));
  }
  return Json{{"hash", config::hash_of(params)}, {"params", std::move(list)}}.dump(2) + "\n";
}

std::string params_markdown() {
  Params defaults;
  const config::ParamTable all = config::param_table(defaults);
  std::string out = "# Parameters\n\nWritten by `toolchain/checks/docs --write`, not by hand.\n\nThe module has " +
                    std::to_string(all.params.size()) + " parameters; as they are here their hash is `" +
                    config::hash_of(defaults) +
                    "`. `--params FILE.toml` changes those that the file names, and `polygmap params list` prints such "
                    "a file with all "
                    "of them.\n";
  std::string last_table = "\n";
  for (const Param& param : all.params) {
    const auto [table, key] = table_and_key(param.name);
    if (table != last_table) {
      last_table = table;
      out += "\n## " + (table.empty() ? std::string("Of the whole module") : "[" + table + "]") +
             "\n\n| name | default | range | what it is |\n|---|---|---|---|\n";
    }
    out +=
        "| `" + key + "` | " + config::text_of(param) + " | " + range(param) + " | " + std::string(param.text) + " |\n";
  }
  return out;
}

std::string params_difference(const Params& params) {
  Params copy = params, defaults;
  const config::ParamTable table = config::param_table(copy), usual = config::param_table(defaults);
  std::string out;
  for (std::size_t i = 0; i < table.params.size(); ++i) {
    if (config::same_value(table.params[i], usual.params[i])) continue;
    out += table.params[i].name + " = " + config::text_of(table.params[i]) + "  # default " +
           config::text_of(usual.params[i]) + "\n";
  }
  return out;
}

std::string reality_markdown() {
  Reality defaults;
  std::string out =
      "# Reality\n\nWritten by `toolchain/checks/docs --write`, not by hand.\n\nWhere the simulated robot "
      "may differ from the data sheet that the module keeps. `polygmap climb --reality R` draws them by the "
      "seed, `--set NAME=VALUE` gives one of them; `summary.json` says what they were. Of several numbers "
      "each is drawn alone.\n\n| name | without | range | at `--reality 1` | what it is |\n|---|---|---|---|---|\n";
  for (const Param& param : config::param_table(defaults).params) {
    std::string drawn = "the same";
    for (const RealityItem& item : reality_items()) {
      if (item.name != param.name) continue;
      const auto signed_text = [](double number) { return (number < 0.0 ? "" : "+") + config::text_of(number); };
      if (item.least == item.most)
        drawn = signed_text(item.most);
      else if (item.least == -item.most)
        drawn = "evenly within +-" + config::text_of(item.most);
      else
        drawn = "evenly from " + signed_text(item.least) + " to " + signed_text(item.most);
    }
    out += "| `" + param.name + "` | " + config::text_of(param) + " | " + range(param) + " | " + drawn + " | " +
           std::string(param.text) + " |\n";
  }
  return out;
}

std::string states_markdown() {
  std::string out =
      "# States\n\nWritten by `toolchain/checks/docs --write`, not by hand.\n\nWhat the module does, and what its "
      "operator may ask of it. A command that a state has no line for changes nothing and is counted as "
      "`operator_refused`. Without an operator it arms and starts by itself (`supervisor.autostart`). Which "
      "failure leads to which state, and within what time, is in [the architecture](../architecture.md).\n\n"
      "| state | what it does |\n|---|---|\n";
  for (const ModuleStateInfo& state : kModuleStateTable) {
    out += "| `" + std::string(state.name) + "` | " + std::string(state.text) + " |\n";
  }
  out += "\n| in | asked to | it becomes |\n|---|---|---|\n";
  for (const OperatorTransition& t : kOperatorTransitions) {
    out += "| `" + std::string(name_of(t.from)) + "` | " + std::string(name_of(t.command)) + " | `" +
           std::string(name_of(t.to)) + "`" + std::string(t.note) + " |\n";
  }
  out +=
      "\nWhat nobody asks for; what a state has no line for changes nothing in it.\n\n"
      "| in | when | it becomes |\n|---|---|---|\n";
  for (const AutomaticTransition& t : kAutomaticTransitions) {
    out += "| `" + std::string(name_of(t.from)) + "` | " + std::string(text_of(t.event)) + " | `" +
           std::string(name_of(t.to)) + "`" + std::string(t.note) + " |\n";
  }
  return out;
}

CLI::App* declare_params(CLI::App& app, ParamsArguments& a) {
  CLI::App* params = app.add_subcommand("params", "The module's parameters: list them, document them, compare a file");
  params->require_subcommand(1);
  a.list = params->add_subcommand("list", "All of them, as a file that --params takes");
  a.list->add_flag("--json", a.json, "As JSON instead, with defaults");
  a.list->add_option("--params", a.file, "As this file has them")->type_name("FILE.toml");
  a.docs = params->add_subcommand("docs", "Their reference as Markdown");
  a.reality = params->add_subcommand("reality", "What climb --reality draws and --set gives, as Markdown");
  a.states = params->add_subcommand("states", "The module's states and what its operator may ask, as Markdown");
  a.diff = params->add_subcommand("diff", "What a file makes different from the defaults");
  a.diff->add_option("FILE.toml", a.file, "Parameters to change")->required()->type_name("");
  return params;
}

int run_params(const ParamsArguments& a, std::ostream& out, std::ostream& err) {
  Params params;
  try {
    if (!a.file.empty()) config::read_params(a.file, params);
  } catch (const config::FileError& error) {
    err << "polygmap: " << error.what() << "\n";
    return kExitUsage;
  }
  if (a.docs->parsed()) {
    out << params_markdown();
  } else if (a.reality->parsed()) {
    out << reality_markdown();
  } else if (a.states->parsed()) {
    out << states_markdown();
  } else if (a.diff->parsed()) {
    const std::string different = params_difference(params);
    out << (different.empty() ? "No parameter differs from its default.\n" : different);
  } else {
    out << (a.json ? params_json(params) : params_toml(params));
  }
  return written(out, err);
}

}  // namespace polygmap::sim
