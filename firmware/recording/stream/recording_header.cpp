// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/stream/recording_header.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/config/param_table.hpp"
#include "firmware/recording/stream/format.hpp"
#include "firmware/recording/stream/outputs.hpp"

namespace polygmap::recording {
namespace {

struct NameHash {
  std::uint64_t hash = 0xcbf29ce484222325U;
  void add(std::string_view text) noexcept {
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
    hash = (hash ^ 0xFFU) * 0x100000001b3U;
  }
  template <Number T>
  void leaf(std::string_view name, int, const T&) noexcept {
    add(name);
    hash = (hash ^ sizeof(T)) * 0x100000001b3U;
  }
  void enter(std::string_view name, int) noexcept { add(name); }
  void leave() noexcept { add("."); }
  void names_only() const noexcept {}
};

void put_name(ByteWriter& out, std::string_view name) {
  out.put(static_cast<std::uint16_t>(name.size()));
  out.put_bytes(name.data(), name.size());
}

void put_numbers(ByteWriter& out, ValueKind kind, const auto* first, std::size_t count) {
  out.put(kind);
  out.put(static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < count; ++i) out.put(first[i]);
}

struct PutValue {
  ByteWriter& out;
  void operator()(const bool* value) const { put_numbers(out, ValueKind::kBool, value, 1); }
  void operator()(const std::int32_t* value) const { put_numbers(out, ValueKind::kI32, value, 1); }
  void operator()(const std::uint32_t* value) const { put_numbers(out, ValueKind::kU32, value, 1); }
  void operator()(const std::int64_t* value) const { put_numbers(out, ValueKind::kI64, value, 1); }
  void operator()(const double* value) const { put_numbers(out, ValueKind::kF64, value, 1); }
  void operator()(std::span<double> values) const { put_numbers(out, ValueKind::kF64, values.data(), values.size()); }
  void operator()(config::EnumValue choice) const { put_numbers(out, ValueKind::kChoice, choice.value, 1); }
  void operator()(config::RotationValue rotation) const {
    put_numbers(out, ValueKind::kF64, rotation.value->data(), 9);
  }
};

// Exactly what the table says a parameter may be; and no rotation that is none.
bool in_range(const config::Param& param) {
  bool good = true;
  const auto check = [&](double x) { good = good && x >= param.least && x <= param.most; };
  if (const auto* rotation = std::get_if<config::RotationValue>(&param.value)) {
    const Mat3& R = *rotation->value;
    return R.allFinite() && (R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-9 &&
           R.determinant() > 0.0;
  }
  if (const auto* numbers = std::get_if<std::span<double>>(&param.value)) {
    for (const double x : *numbers) check(x);
  } else if (const auto* choice = std::get_if<config::EnumValue>(&param.value)) {
    good = *choice->value < choice->names.size();
  } else {
    check(config::number_of(param));
  }
  return good;
}

struct Slots {
  ValueKind kind;
  std::size_t count;
};
struct SlotsOf {
  Slots operator()(const bool*) const { return {ValueKind::kBool, 1}; }
  Slots operator()(const std::int32_t*) const { return {ValueKind::kI32, 1}; }
  Slots operator()(const std::uint32_t*) const { return {ValueKind::kU32, 1}; }
  Slots operator()(const std::int64_t*) const { return {ValueKind::kI64, 1}; }
  Slots operator()(const double*) const { return {ValueKind::kF64, 1}; }
  Slots operator()(std::span<double> values) const { return {ValueKind::kF64, values.size()}; }
  Slots operator()(config::EnumValue) const { return {ValueKind::kChoice, 1}; }
  Slots operator()(config::RotationValue) const { return {ValueKind::kF64, 9}; }
};
struct GetValue {
  ByteReader& in;
  void operator()(std::span<double> values) const {
    for (double& value : values) value = in.get<double>();
  }
  void operator()(config::EnumValue choice) const { *choice.value = in.get<std::uint8_t>(); }
  void operator()(config::RotationValue rotation) const { (*this)(std::span<double>(rotation.value->data(), 9)); }
  template <Number T>
  void operator()(T* value) const {
    *value = in.get<T>();
  }
};

// A name of a foreign file as it may stand in a sentence.
std::string printable(std::string name) {
  for (char& c : name) c = c >= ' ' && c <= '~' ? c : '?';
  return name.substr(0, 60);
}

class HeaderReader {
 public:
  HeaderReader(std::span<const std::byte> bytes, RecordingHeader& header)
      : in_(bytes), params_(header.params), camera_(header.camera), rows_(header.rows) {}
  [[nodiscard]] bool read() {
    return read_version() && read_params() && read_schedule() && read_camera() && read_gain_limits() &&
           (in_.at_end() || complain("something follows the header"));
  }
  [[nodiscard]] const std::string& complaint() const noexcept { return complaint_; }

 private:
  bool complain(const std::string& what) {
    complaint_ = what;
    return false;
  }
  [[nodiscard]] bool take_name(std::string& name);
  [[nodiscard]] bool read_version();
  [[nodiscard]] bool read_params();
  [[nodiscard]] bool read_schedule();
  [[nodiscard]] bool read_camera();
  [[nodiscard]] bool read_gain_limits();

  ByteReader in_;
  Params& params_;
  CameraIntrinsics& camera_;
  std::vector<std::uint8_t>& rows_;
  std::string complaint_;
};

bool HeaderReader::take_name(std::string& name) {
  name = in_.get_text(in_.get<std::uint16_t>());
  return !in_.failed() || complain("the header ends within a name");
}

bool HeaderReader::read_version() {
  if (in_.get_text(kMagic.size()) != kMagic) return complain("its header is not that of a recording");
  const auto version = in_.get<std::uint32_t>();
  if (version != kVersion) {
    return complain("version " + std::to_string(version) + ", where this program reads " + std::to_string(kVersion));
  }
  return in_.get<std::uint64_t>() == hash_of_fields() || complain("it has the fields of another build of the module");
}

bool HeaderReader::read_params() {
  config::ParamTable table = config::param_table(params_);
  const auto count = in_.get<std::uint32_t>();
  if (count > kMaxEntries) return complain(std::to_string(count) + " parameters");
  std::vector<bool> given(table.params.size());
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string name;
    if (!take_name(name)) return false;
    // A recording of this build has them in the table's order.
    auto param = table.params.begin() + std::min<std::ptrdiff_t>(i, std::ssize(table.params));
    if (param == table.params.end() || param->name != name) {
      param = std::ranges::find(table.params, name, &config::Param::name);
    }
    if (param == table.params.end()) return complain("this module has no parameter \"" + printable(name) + "\"");
    const auto at = static_cast<std::size_t>(param - table.params.begin());
    if (given[at]) return complain("parameter \"" + name + "\" is there twice");
    given[at] = true;
    const Slots slots = std::visit(SlotsOf{}, param->value);
    const auto kind = in_.get<ValueKind>();
    if (kind != slots.kind || in_.get<std::uint32_t>() != slots.count) {
      return complain("parameter \"" + name + "\" is of another type");
    }
    std::visit(GetValue{in_}, param->value);
    if (in_.failed() || !in_range(*param)) return complain("parameter \"" + name + "\" is outside its range");
  }
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!given[i]) return complain("parameter \"" + table.params[i].name + "\" is missing");
  }
  const auto value_of = [&](const std::string& name) {
    return config::number_of(*std::ranges::find(table.params, name, &config::Param::name));
  };
  for (const config::ParamOrder& order : table.orders) {
    if (value_of(order.less) > value_of(order.more)) {
      return complain("parameter \"" + order.less + "\" is above \"" + order.more + "\"");
    }
  }
  return true;
}

bool HeaderReader::read_schedule() {
  const auto count = in_.get<std::uint32_t>();
  if (count > kTasks.size()) return complain("a schedule of " + std::to_string(count) + " rows");
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string name;
    if (!take_name(name)) return false;
    const auto task = std::ranges::find_if(kTasks, [&](const Task& t) { return t.row.task == name; });
    if (task == kTasks.end()) return complain("this module has no row \"" + printable(name) + "\" in its schedule");
    if (in_.get<std::uint8_t>() != task->row.lane) return complain("row \"" + name + "\" is in another lane");
    constexpr std::size_t kRest_bytes = 2 + 4 + 4 + 1;  // what it paid is in each call
    (void)in_.get_bytes(kRest_bytes);
    rows_.push_back(static_cast<std::uint8_t>(task - kTasks.begin()));
  }
  return true;
}

bool HeaderReader::read_camera() {
  FieldReader reader(in_);
  walk(reader, "camera", camera_);
  const bool fits = camera_.width_px > 0 && camera_.height_px > 0 && camera_.width_px <= kDepthWidth_px &&
                    camera_.height_px <= kDepthHeight_px;
  if (!fits) {
    return complain("a camera of " + std::to_string(camera_.width_px) + "x" + std::to_string(camera_.height_px) +
                    " pixels");
  }
  for (const double x : {camera_.fx_px, camera_.fy_px, camera_.cx_px, camera_.cy_px, camera_.depth_unit_m}) {
    if (!std::isfinite(x)) return complain("the camera's intrinsics are no numbers");
  }
  return !in_.failed() || complain("the header ends within its camera");
}

bool HeaderReader::read_gain_limits() {
  auto& limits = params_.robot.drives.gain_limits;
  FieldReader reader(in_);
  walk(reader, "gain_limits", limits);
  for (const GainLimits& most : limits) {
    if (!(most.kp_nmprad >= 0.0 && most.kd_nmsprad >= 0.0))
      return complain("a drive's gains are below 0 or no numbers");
  }
  return !in_.failed() || complain("the header ends within the drives' gains");
}

}  // namespace

std::uint64_t hash_of_fields() noexcept {
  NameHash f;
  walk_recorded(f);
  return f.hash;
}

void put_recording_header(ByteWriter& out, const Params& params, const CameraIntrinsics& camera) {
  out.put_bytes(kMagic.data(), kMagic.size());
  out.put(kVersion);
  out.put(hash_of_fields());
  Params copy = params;
  const config::ParamTable table = config::param_table(copy);
  out.put(static_cast<std::uint32_t>(table.params.size()));
  for (const config::Param& param : table.params) {
    put_name(out, param.name);
    std::visit(PutValue{out}, param.value);
  }
  out.put(static_cast<std::uint32_t>(kTasks.size()));
  for (const Task& task : kTasks) {
    put_name(out, task.row.task);
    out.put(task.row.lane);
    out.put(task.row.slots);
    out.put(task.row.budget_us);
    out.put(task.row.unit_cost_ns);
    out.put(task.row.shed_order);
  }
  FieldWriter writer(out, nullptr);
  walk(writer, "camera", camera);
  walk(writer, "gain_limits", params.robot.drives.gain_limits);
}

std::string read_recording_header(std::span<const std::byte> bytes, RecordingHeader& header) {
  HeaderReader reader(bytes, header);
  return reader.read() ? std::string() : reader.complaint();
}

}  // namespace polygmap::recording
