// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/recording_file.hpp"

#include <sys/types.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "firmware/config/param_table.hpp"

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

// How long a message without vectors is.
struct FieldSize {
  std::size_t bytes = 0;
  void leaf(std::string_view, int, const auto& value) noexcept { bytes += sizeof value; }
  void enter(std::string_view, int) noexcept {}
  void leave() noexcept {}
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

std::size_t bytes_of(ValueKind kind) {
  switch (kind) {
    case ValueKind::kBool:
    case ValueKind::kChoice:
      return 1;
    case ValueKind::kI32:
    case ValueKind::kU32:
      return 4;
    case ValueKind::kI64:
    case ValueKind::kF64:
      return 8;
  }
  return 0;
}

// A name of a foreign file as it may stand in a sentence.
std::string printable(std::string name) {
  for (char& c : name) c = c >= ' ' && c <= '~' ? c : '?';
  return name.substr(0, 60);
}

bool time_possible(std::int64_t t_ns) { return t_ns >= 0 && t_ns <= kLatest_ns; }

// Empty when the directory is there with both files; a byte of a file that is not there helps nobody.
std::string missing_of(const std::string& directory) {
  std::error_code none;
  const std::string is_none = "\"" + directory + "\" is no recording: ";
  if (!std::filesystem::exists(directory, none)) return is_none + "there is no such directory.";
  if (!std::filesystem::is_directory(directory, none))
    return is_none + "it is no directory, and climb --record writes one.";
  for (const char* name : {kFileName, kPictureFileName}) {
    const auto status = std::filesystem::status(std::filesystem::path(directory) / name, none);
    if (!std::filesystem::exists(status)) return is_none + "there is no file " + name + " in it.";
    if (std::filesystem::is_directory(status)) return is_none + name + " in it is a directory.";
  }
  return {};
}

}  // namespace

std::uint64_t hash_of_fields() noexcept {
  NameHash f;
  walk_recorded(f);
  return f.hash;
}

RecordingFile::~RecordingFile() {
  for (std::FILE* file : {file_, picture_file_}) {
    if (file != nullptr) (void)std::fclose(file);
  }
}

bool RecordingFile::complain_at(const char* name, std::uint64_t place, const std::string& what) {
  complaint_ = "\"" + directory_ + "/" + name + "\", byte " + std::to_string(place) + ": " + what + ".";
  return false;
}
bool RecordingFile::complain(const std::string& what) { return complain_at(kFileName, record_place_, what); }

// The next bytes of the file, into in_.
bool RecordingFile::load(std::size_t count, const char* what) {
  record_place_ = place_;
  memory_.resize(std::max(memory_.size(), count));
  if (std::fread(memory_.data(), 1, count, file_) != count) {
    return complain(std::string("the file ends within ") + what);
  }
  place_ += count;
  in_ = ByteReader(std::span<const std::byte>(memory_).first(count));
  return true;
}

template <Number T>
bool RecordingFile::take(T& value, const char* what) {
  if (!load(sizeof value, what)) return false;
  value = in_.get<T>();
  return true;
}

bool RecordingFile::take_name(std::string& name) {
  std::uint16_t length = 0;
  if (!take(length, "a name's length")) return false;
  if (length > 200) return complain("a name of " + std::to_string(length) + " characters");
  if (!load(length, "a name")) return false;
  name = in_.get_text(length);
  return true;
}

bool RecordingFile::open(const std::string& directory) {
  directory_ = directory;
  if (complaint_ = missing_of(directory); !complaint_.empty()) return false;
  for (auto& [file, name] : {std::pair{&file_, kFileName}, std::pair{&picture_file_, kPictureFileName}}) {
    *file = std::fopen((directory + "/" + name).c_str(), "rb");
    if (*file == nullptr) {
      complaint_ = "\"" + directory + "/" + name + "\" cannot be read: " + std::strerror(errno) + ".";
      return false;
    }
  }
  return read_beginning();
}

bool RecordingFile::open(const std::string& name, std::FILE* recording, std::FILE* pictures) {
  directory_ = name;
  file_ = recording;
  picture_file_ = pictures;
  return read_beginning();
}

bool RecordingFile::read_beginning() {
  return read_header() && read_params() && read_schedule() && read_camera() && read_gain_limits() && open_pictures();
}

bool RecordingFile::read_header() {
  if (!load(kMagic.size(), "its first bytes")) return false;
  if (in_.get_text(kMagic.size()) != kMagic) return complain("this is no recording");
  std::uint32_t version = 0;
  if (!take(version, "the version")) return false;
  if (version != kVersion) {
    return complain("version " + std::to_string(version) + ", where this program reads " + std::to_string(kVersion));
  }
  std::uint64_t fields = 0;
  if (!take(fields, "the header")) return false;
  return fields == hash_of_fields() || complain("it has the fields of another build of the module");
}

bool RecordingFile::read_params() {
  config::ParamTable table = config::param_table(params_);
  std::uint32_t count = 0;
  if (!take(count, "the parameters")) return false;
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
    if (!load(1 + sizeof(std::uint32_t), "a parameter")) return false;
    const auto kind = in_.get<ValueKind>();
    if (kind != slots.kind || in_.get<std::uint32_t>() != slots.count) {
      return complain("parameter \"" + name + "\" is of another type");
    }
    if (!load(slots.count * bytes_of(kind), "a parameter")) return false;
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

bool RecordingFile::read_schedule() {
  std::uint32_t count = 0;
  if (!take(count, "the schedule")) return false;
  if (count > kTasks.size()) return complain("a schedule of " + std::to_string(count) + " rows");
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string name;
    if (!take_name(name)) return false;
    const auto task = std::ranges::find_if(kTasks, [&](const Task& t) { return t.row.task == name; });
    if (task == kTasks.end()) return complain("this module has no row \"" + printable(name) + "\" in its schedule");
    constexpr std::size_t kRest_bytes = 1 + 2 + 4 + 4 + 1;  // what it paid is in each call
    if (!load(kRest_bytes, "the schedule")) return false;
    if (in_.get<std::uint8_t>() != task->row.lane) return complain("row \"" + name + "\" is in another lane");
    rows_.push_back(static_cast<std::uint8_t>(task - kTasks.begin()));
  }
  return true;
}

bool RecordingFile::read_camera() {
  FieldSize size;
  walk(size, "camera", camera_);
  if (!load(size.bytes, "the camera")) return false;
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
  return true;
}

bool RecordingFile::read_gain_limits() {
  auto& limits = params_.robot.drives.gain_limits;
  FieldSize size;
  walk(size, "gain_limits", limits);
  if (!load(size.bytes, "the drives' gains")) return false;
  FieldReader reader(in_);
  walk(reader, "gain_limits", limits);
  for (const GainLimits& most : limits) {
    if (!(most.kp_nmprad >= 0.0 && most.kd_nmsprad >= 0.0))
      return complain("a drive's gains are below 0 or no numbers");
  }
  return true;
}

bool RecordingFile::open_pictures() {
  std::array<std::byte, kPictureHeader_bytes> header;
  if (std::fread(header.data(), 1, header.size(), picture_file_) != header.size()) {
    return complain_at(kPictureFileName, 0, "the file ends within its header");
  }
  ByteReader in(header);
  if (in.get_text(kPictureMagic.size()) != kPictureMagic) {
    return complain_at(kPictureFileName, 0, "these are no pictures of a recording");
  }
  const auto version = in.get<std::uint32_t>();
  if (version != kVersion) return complain_at(kPictureFileName, 8, "version " + std::to_string(version));
  const auto width_px = in.get<std::int32_t>(), height_px = in.get<std::int32_t>();
  if (width_px != camera_.width_px || height_px != camera_.height_px) {
    return complain_at(kPictureFileName, 12, "the pictures' size is not the camera's");
  }
  return true;
}

bool RecordingFile::read_picture(const Picture& picture, std::span<std::uint16_t> pixels) {
  const std::uint64_t place = kPictureHeader_bytes + std::uint64_t{picture.index} * pixels.size_bytes();
  if (fseeko(picture_file_, static_cast<off_t>(place), SEEK_SET) != 0 ||
      std::fread(pixels.data(), sizeof(std::uint16_t), pixels.size(), picture_file_) != pixels.size()) {
    return complain_at(kPictureFileName, place, "the file ends within picture " + std::to_string(picture.index));
  }
  if (hash_of_pixels(pixels.data(), pixels.size()) != picture.hash) {
    return complain_at(kPictureFileName, place,
                       "picture " + std::to_string(picture.index) +
                           " is not the one that was recorded, or its hash in \"" + kFileName + "\", byte " +
                           std::to_string(picture.place) + ", is wrong");
  }
  return true;
}

bool RecordingFile::read(Record& record) {
  if (!load(1 + sizeof(std::uint32_t), "a record: it was cut off")) return false;
  const std::uint64_t place = record_place_;
  record.kind = in_.get<RecordKind>();
  const auto length = in_.get<std::uint32_t>();
  if (length > kMaxRecord_bytes) return complain("a record of " + std::to_string(length) + " bytes");
  if (!load(length, "a record")) return false;
  record_place_ = place;
  bool good = false;
  switch (record.kind) {
    case RecordKind::kRow:
      return parse_row(record.row);
    case RecordKind::kEvent:
      good = parse_event(record.event);
      break;
    case RecordKind::kStop:
      good = true;
      break;
    case RecordKind::kCycle:
      good = parse_cycle(record.cycle_lane, record.cycle);
      break;
    case RecordKind::kEnd:
      return parse_end();
    default:
      return complain("no record begins so");
  }
  if (!complaint_.empty()) return false;
  return (good && !in_.failed() && in_.at_end()) || complain("a record that cannot be");
}

bool RecordingFile::parse_end() {
  const auto cycles = in_.get<std::uint64_t>();
  const auto pictures = in_.get<std::uint32_t>();
  if (in_.failed() || !in_.at_end()) return complain("a record that cannot be");
  if (cycles != cycles_ || pictures != pictures_) return complain("cycles or pictures are missing");
  return std::fgetc(file_) == EOF || complain("something follows the end");
}

bool RecordingFile::parse_event(ExecutiveEventCount& event) {
  event.lane = in_.get<std::uint8_t>();
  event.event = in_.get<ExecutiveEvent>();
  event.at_ns = in_.get<std::int64_t>();
  event.times = in_.get<std::uint32_t>();
  return event.lane < kLaneCount && time_possible(event.at_ns) &&
         index_of_event(event.event) < kEventTable<ExecutiveEvent>.size();
}

bool RecordingFile::parse_cycle(std::uint8_t& lane, CycleReport& cycle) {
  lane = in_.get<std::uint8_t>();
  cycle.cycle = in_.get<std::uint64_t>();
  cycle.due_ns = in_.get<std::int64_t>();
  cycle.slot = in_.get<std::uint8_t>();
  for (std::uint32_t* const mask : {&cycle.ran, &cycle.shed, &cycle.deferred, &cycle.overran}) {
    const auto recorded = in_.get<std::uint32_t>();
    *mask = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) *mask |= ((recorded >> i) & 1U) << rows_[i];
  }
  cycle.overrun = in_.get<bool>();
  cycle.caught_up = in_.get<bool>();
  cycle.skipped_before = in_.get<std::uint64_t>();
  cycles_ += lane == kControlLane ? 1U : 0U;
  return lane < kLaneCount && time_possible(cycle.due_ns);
}

bool RecordingFile::parse_view(RowCall& row) {
  const auto can_be = [](std::int64_t frame_ns) { return frame_ns == kNoFrame_ns || time_possible(frame_ns); };
  row.other_finished_ns = in_.get<std::int64_t>();
  const auto taken = in_.get<std::uint8_t>();
  if (!can_be(row.other_finished_ns) || taken > kMaxTaken) return false;
  row.taken.clear();
  for (std::size_t i = 0; i < taken; ++i) {
    const auto frame_ns = in_.get<std::int64_t>();
    (void)row.taken.try_push_back({frame_ns, in_.get<bool>()});
    if (!can_be(frame_ns)) return false;
  }
  return true;
}

bool RecordingFile::parse_row(RowCall& row) {
  const auto index = in_.get<std::uint8_t>();
  if (index >= rows_.size()) return complain("a row that the schedule does not have");
  row.row = rows_[index];
  row.cycle_ns = in_.get<std::int64_t>();
  row.units = in_.get<std::int32_t>();
  const auto calls = in_.get<std::uint16_t>();
  const std::size_t lane = kTasks[row.row].row.lane;
  const bool in_order =
      row.cycle_ns > last_cycle_ns_[lane] || (row.cycle_ns == last_cycle_ns_[lane] && row.row > last_row_[lane]);
  if (!time_possible(row.cycle_ns) || !in_order) return complain("a row out of its order");
  last_cycle_ns_[lane] = row.cycle_ns;
  last_row_[lane] = row.row;
  if (calls > kMaxCallsPerRow) return complain(std::to_string(calls) + " calls of ports in a row");
  row.calls.resize(calls);
  for (PortCall& call : row.calls) {
    if (!parse_call(call)) return complaint_.empty() ? complain("a call of a port that cannot be") : false;
  }
  if (!parse_view(row)) return complain("frames of the other lane that cannot be");
  row.progress = in_.get<std::uint8_t>();
  row.units_left = in_.get<std::int32_t>();
  if (in_.failed()) return complain("a row that is too short");
  row.outputs = in_;
  return true;
}

bool RecordingFile::parse_call(PortCall& call) {
  call.kind = in_.get<CallKind>();
  call.gave = in_.get<bool>();
  FieldReader reader(in_);
  switch (call.kind) {
    case CallKind::kReadImu:
      if (call.gave) walk(reader, "imu", call.imu);
      break;
    case CallKind::kReadJoints:
      if (call.gave) walk(reader, "joints", call.joints);
      break;
    case CallKind::kReadLidar:
      if (call.gave) walk(reader, "lio", call.lio);
      break;
    case CallKind::kReadOperator:
      if (call.gave) walk(reader, "command", call.asked);
      break;
    case CallKind::kWriteJoints:
      walk(reader, "taken", call.taken);
      if (call.gave != call.taken.is_all()) return false;
      walk(reader, "command", call.command);
      break;
    case CallKind::kAcquire: {
      if (!call.gave) break;
      call.frame.stamp_ns = in_.get<std::int64_t>();
      call.frame.sequence = in_.get<std::uint32_t>();
      call.frame.width_px = in_.get<std::int32_t>();
      call.frame.height_px = in_.get<std::int32_t>();
      const auto pixels = in_.get<std::uint8_t>();
      if (pixels > static_cast<std::uint8_t>(Pixels::kOtherSize)) return false;
      const bool cameras = call.frame.width_px == camera_.width_px && call.frame.height_px == camera_.height_px;
      call.picture = {static_cast<Pixels>(pixels), pictures_, 0, record_place_};
      if (cameras != (call.picture.pixels == Pixels::kStored) && call.picture.pixels != Pixels::kNone) return false;
      if (call.picture.pixels != Pixels::kStored) break;
      call.picture.hash = in_.get<std::uint64_t>();
      ++pictures_;
      break;
    }
    case CallKind::kJointStatus:
      walk(reader, "status", call.status);
      break;
    case CallKind::kRelease:
      break;
    default:
      return false;
  }
  return !in_.failed();
}

}  // namespace polygmap::recording
