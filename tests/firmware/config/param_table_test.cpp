// SPDX-License-Identifier: Apache-2.0
// The parameters' field lists: none forgets a field, every default is in its range, and the module bears either end.
#include "firmware/config/param_table.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>

#include "firmware/params.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/slow_machine.hpp"
#include "tests/support/trapped_module.hpp"

namespace polygmap::config {
namespace {

struct Anything {
  template <class T>
  operator T() const;
};
template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return requires { T{((void)I, Anything{})...}; };
}
// How many fields an aggregate has: as many values as its braces take.
template <class T, std::size_t N = 64>
constexpr std::size_t field_count() {
  if constexpr (N == 0 || takes<T>(std::make_index_sequence<N>{})) {
    return N;
  } else {
    return field_count<T, N - 1>();
  }
}

// Of a struct's base, which counts as one field of its own.
template <class T>
inline constexpr std::size_t kInherited = 0;
template <>
inline constexpr std::size_t kInherited<Estimator::Params> = field_count<ProprioceptiveOdometry::Params>() - 1;

// Fields that come with the drives, out of their bus file, and are no parameters.
template <class T>
inline constexpr std::size_t kFromDrives = 0;
template <>
inline constexpr std::size_t kFromDrives<DriveModel> = 1;

struct Example {
  double a = 0.0;
  bool b = false;
  Vec3 c = Vec3::Zero();
  std::array<double, 6> d{};
  Transform e;
  GaitPattern f = GaitPattern::kDoubleStep;
};
static_assert(field_count<Example>() == 6);

// Holds a struct's list against the struct.
class Walk {
 public:
  explicit Walk(std::string table) : table_(std::move(table)) {}
  template <class T, class... Rest>
  void operator()(std::string_view name, T& field, Rest&&...) {
    const std::string full = table_ + "." + std::string(name);
    const auto address = reinterpret_cast<std::uintptr_t>(&field);
    EXPECT_GT(address, last_) << full << " is not in the order of the fields, or stands twice";
    EXPECT_TRUE(names_.insert(std::string(name)).second) << full;
    last_ = address;
    if constexpr (std::is_class_v<T> && sizeof...(Rest) == 0) of(field, full);
    if constexpr (requires { std::is_class_v<typename T::value_type>; }) {
      if constexpr (std::is_class_v<typename T::value_type>) {
        for (auto& one : field) of(one, full);
      }
    }
  }
  void ordered(std::string_view less, std::string_view more) {
    EXPECT_TRUE(names_.contains(std::string(less)) && names_.contains(std::string(more))) << less << " " << more;
  }
  template <class T>
  static void of(T& object, const std::string& name) {
    Walk walk(name);
    T::visit(object, walk);
    EXPECT_EQ(walk.names_.size(), field_count<T>() + kInherited<T> - kFromDrives<T>)
        << name << " has other fields than its list";
  }

 private:
  std::string table_;
  std::set<std::string> names_;
  std::uintptr_t last_ = 0;
};

TEST(ParamTable, EveryField_IsListedOnceAndInOrder) {
  Params params;
  Walk::of(params, "Params");
}

TEST(ParamTable, EveryParameter_HasATextAndADefaultInItsRange) {
  Params params;
  const ParamTable table = param_table(params);
  EXPECT_GT(table.params.size(), 300U);
  std::set<std::string> names;
  const auto within = [](const Param& p, double value) {
    EXPECT_TRUE(value >= p.least && value <= p.most) << p.name << " = " << value;
  };
  for (const Param& p : table.params) {
    EXPECT_TRUE(names.insert(p.name).second) << p.name;
    EXPECT_LT(p.least, p.most) << p.name;
    EXPECT_TRUE(p.text.ends_with(".")) << p.name;
    if (auto* real = std::get_if<double*>(&p.value)) within(p, **real);
    if (auto* whole = std::get_if<std::int32_t*>(&p.value)) within(p, **whole);
    if (auto* count = std::get_if<std::uint32_t*>(&p.value)) within(p, **count);
    if (auto* ns = std::get_if<std::int64_t*>(&p.value)) within(p, static_cast<double>(**ns));
    if (auto* reals = std::get_if<std::span<double>>(&p.value)) {
      for (const double value : *reals) within(p, value);
    }
  }
}

TEST(ParamTable, Unit_IsTheLongestSuffixThatFits) {
  EXPECT_EQ(unit_of("gait.below_m"), "m");
  EXPECT_EQ(unit_of("walk_m_per_sqrt_s"), "m/sqrt(s)");
  EXPECT_EQ(unit_of("max_accel_mps2"), "m/s^2");
  EXPECT_EQ(unit_of("rest_sigmas"), "sigma");
  EXPECT_EQ(unit_of("gain"), "");
}

TEST(ParamHash, AnyBitOfAnyValue_ChangesIt) {
  const std::string usual = hash_of(Params{});
  EXPECT_EQ(usual.size(), 16U);
  EXPECT_EQ(hash_of(Params{}), usual);
  std::set<std::string> hashes{usual};
  Params params;
  const std::size_t count = param_table(params).params.size();
  for (std::size_t i = 0; i < count; ++i) {
    Params changed;
    const ParamTable table = param_table(changed);
    std::visit(
        [](auto value) {
          using T = decltype(value);
          if constexpr (std::is_same_v<T, bool*>) {
            *value = !*value;
          } else if constexpr (std::is_same_v<T, double*>) {
            *value = std::nextafter(*value, std::numeric_limits<double>::infinity());
          } else if constexpr (std::is_same_v<T, std::span<double>>) {
            value.back() = std::nextafter(value.back(), std::numeric_limits<double>::infinity());
          } else if constexpr (std::is_same_v<T, EnumValue>) {
            *value.value = static_cast<std::uint8_t>(1 - *value.value);
          } else if constexpr (std::is_same_v<T, RotationValue>) {
            (*value.value)(2, 2) = std::nextafter((*value.value)(2, 2), 2.0);
          } else {
            ++*value;
          }
        },
        table.params[i].value);
    EXPECT_TRUE(hashes.insert(hash_of(changed)).second) << table.params[i].name;
  }
}

// At one end of its range. False where the other end is the same.
bool set_to_end(const Param& p, bool most) {
  const double end = most ? p.most : p.least;
  return std::visit(
      [&](auto value) {
        using T = decltype(value);
        if constexpr (std::is_same_v<T, std::span<double>>) {
          std::ranges::fill(value, end);
        } else if constexpr (std::is_same_v<T, EnumValue>) {
          *value.value = static_cast<std::uint8_t>(end);
        } else if constexpr (std::is_same_v<T, RotationValue>) {
          *value.value = rotation_zyx(end, 0.0, 0.0);
          return most;  // a whole turn
        } else {
          *value = static_cast<std::remove_pointer_t<T>>(end);
        }
        return true;
      },
      p.value);
}

// As a file would have to: what may not be less goes along.
void keep_order(const ParamTable& table, const Param& moved, bool most) {
  for (const ParamOrder& order : table.orders) {
    if (moved.name != (most ? order.less : order.more)) continue;
    const auto& other = *std::ranges::find(table.params, most ? order.more : order.less, &Param::name);
    if (auto* real = std::get_if<double*>(&other.value)) {
      const double at = **std::get_if<double*>(&moved.value);
      **real = most ? std::max(**real, at) : std::min(**real, at);
    }
  }
}

// Before stairs, from switching on to the air of a swing where the parameter allows it.
testing::AssertionResult bears(const Params& params) {
  constexpr int kTicks = test::kSlowMachine ? 120 : 700, kTicksPerPicture = 112;
  test::FakeRobot robot(0.05);
  test::TrappedModule module(robot.ports(), params, robot.clock);
  for (int i = 0; i < kTicks; ++i) {
    robot.camera_speaks = i % kTicksPerPicture < 16;
    robot.advance();
    module.tick();
    const auto& sent = robot.joints.commands();
    if (sent.empty()) continue;
    for (const auto& joint : sent.newest().joints) {
      if (!std::isfinite(joint.q_rad + joint.dq_radps + joint.tau_ff_nm + joint.kp_nmprad + joint.kd_nmsprad)) {
        return testing::AssertionFailure() << "a command is no number in tick " << i;
      }
    }
  }
  return testing::AssertionSuccess();
}

void expect_either_end_borne(std::size_t step) {
  Params params;
  const std::size_t count = param_table(params).params.size();
  for (std::size_t i = 0; i < count; i += step) {
    for (const bool most : {false, true}) {
      Params at_end;
      at_end.estimator.standstill.duration_s = 0.1;
      const ParamTable table = param_table(at_end);
      if (!set_to_end(table.params[i], most)) continue;
      keep_order(table, table.params[i], most);
      EXPECT_TRUE(bears(at_end)) << table.params[i].name << (most ? " at its most" : " at its least");
    }
  }
}

TEST(ParamRange, EitherEndOfEverySeventh_LeavesCommandsNumbers) { expect_either_end_borne(7); }
TEST(LongParamRange, EitherEndOfEveryOne_LeavesCommandsNumbers) { expect_either_end_borne(1); }

}  // namespace
}  // namespace polygmap::config
