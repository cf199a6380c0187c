// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/segments/scanline_segments.hpp"

#include <algorithm>
#include <bit>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

constexpr unsigned kTriedBit = 8;  // of try_blocks(): from here on, groups that were tried

using simd::all, simd::Wide;

constexpr float kNowhere =
    -1e9F;                       // 1/m: the line of a column without a segment, which no row fits: not a depth of 1 mm
constexpr float kNever = -1e9F;  // its absent rows
constexpr float kNoSpread = 1e-9F;                        // added to a sum of squares that may be 0
constexpr float kFitted = 3.0F;                           // rows that make a line
constexpr std::int32_t kBentRows = 3;                     // whose residuals kMemory still knows
constexpr std::int32_t kBlockColumns = 2 * Wide::nlanes;  // columns whose blocks are tried together
static_assert(kColumns % kBlockColumns == 0);

}  // namespace

struct ScanlineSegmentation::Wides {
  Wide zero = all(0.0F), one = all(1.0F), two = all(2.0F), four = all(4.0F);
  Wide memory = all(1.0F - kMemory), fitted = all(kFitted);
  InverseSigma<Wide> sigma, jump;
  Wide outlier_weight, floor2, outlier2, bend2, long_segment, max_gap, fy;
  explicit Wides(const ScanlineSegmentation& s) noexcept
      : sigma(all(s.sigma_)),
        jump(all(s.jump_)),
        outlier_weight(all(s.outlier_weight_)),
        floor2(all(s.floor2_)),
        outlier2(all(s.outlier2_)),
        bend2(all(s.bend2_)),
        long_segment(all(s.bend_rows_)),
        max_gap(all(s.max_gap_)),
        fy(all(s.fy_)) {}
};

void ScanlineSegmentation::begin(const Params& params, const DepthNoiseModel& noise, const CameraIntrinsics& intrinsics,
                                 const ColumnImage& image) noexcept {
  image_ = &image;
  column_count_ = intrinsics.width_px / kColumn_px;
  height_px_ = intrinsics.height_px;
  outlier2_ = static_cast<float>(math::square(params.outlier_sigmas));
  bend2_ = static_cast<float>(math::square(params.bend_sigmas));
  bend_rows_ = static_cast<float>(params.bend_rows);
  sigma_ = noise.scaled(math::sqrt(noise.mean_share(kColumn_px))).inverse_sigma_f();
  floor2_ = static_cast<float>(math::square(params.floor_m));
  // jump_share w + jump_sigmas sigma
  const auto sigmas = static_cast<float>(params.jump_sigmas);
  jump_ = {sigmas * sigma_.base, static_cast<float>(params.jump_share) + sigmas * sigma_.per_metre,
           sigmas * sigma_.quadratic};
  max_gap_ = static_cast<float>(params.max_gap_px);
  const std::int32_t outlier_weight = params.max_gap_px / kPending + 1;
  outlier_weight_ = static_cast<float>(outlier_weight);
  fy_ = static_cast<float>(intrinsics.fy_px);
  cy_ = static_cast<float>(intrinsics.cy_px);
  for (std::int32_t g = 0; g < kColumns; ++g) {
    clear(g);
    segments_[static_cast<std::size_t>(g)].clear();
  }
  overflow_ = 0;
}

void ScanlineSegmentation::clear(std::int32_t column) noexcept {
  const auto g = static_cast<std::size_t>(column);
  open_.rows[g] = open_.slope[g] = open_.lever[g] = open_.drift[g] = 0.0F;
  open_.squares[g] = kNoSpread;
  open_.value[g] = kNowhere;
  open_.absent[g] = kNever;
}

void ScanlineSegmentation::add_rows(std::int32_t first, std::int32_t last) noexcept {
  const Wides c(*this);
  // Columns whose rows cannot be added as a block, or do not go on, take them one by one, a row across them all before
  // the next: a column's rows wait for one another, columns do not.
  std::array<std::int32_t, kColumns / kGroup + 1> singly;
  std::size_t count = 0;
  std::int32_t tried = 0, handled = 0;
  for (std::int32_t column = 0; column < column_count_; column += kBlockColumns) {
    const std::uint32_t done = last - first + 1 == kBlock ? try_blocks(c, column, first) : 0U;
    for (std::int32_t i = 0; i < kBlockColumns / kGroup && column + i * kGroup < column_count_; ++i) {
      tried += static_cast<std::int32_t>(done >> kTriedBit >> i & 1U);  // a register may reach beyond a narrow picture
      singly[count] = column + i * kGroup;
      count += (done >> i & 1U) != 0 ? 0U : 1U;
    }
  }
  // Of a group of columns, whatever the register's width: the same on every machine.
  constexpr std::int32_t kTriedInstructions = 455, kLeftInstructions = 90;
  work_.add(column_count_ / kGroup * kLeftInstructions + tried * kTriedInstructions);
  if (count == 0) return;
  work_.add((last - first + 1) * static_cast<std::int32_t>(count), 195);
  for (std::int32_t row = first; row <= last; ++row) {
    static_assert(64 % kGroup == 0);
    std::array<std::uint64_t, (kColumns + 63) / 64> events{};
    for (std::size_t i = 0; i < count; ++i) {
      const std::int32_t column = singly[i];
      events[static_cast<std::size_t>(column / 64)] |= std::uint64_t{add_row(c, column, row)} << (column % 64);
    }
    for (std::size_t i = 0; i < events.size(); ++i) {
      for (std::uint64_t left = events[i]; left != 0; left &= left - 1) {
        ++handled;
        handle(static_cast<std::int32_t>(64 * i) + std::countr_zero(left), row);
      }
    }
  }
  work_.add(handled, 240);
}

// A register of columns over a block of rows. Most blocks go on as their columns' lines say: one update for four rows.
struct ScanlineSegmentation::Block {
  const Wides& c;
  std::size_t g;  // first column
  Wide rows, slope, lever, value, drift, absent, w2, leans, spread, limit;
  // Sums over the block's rows that join, x from the row before the block, and of residuals from the line so far.
  Wide n = c.zero, sum_x = c.zero, sum_xx = c.zero, sum_r = c.zero, sum_xr = c.zero;
  Wide moved = c.zero;  // by how much, nearly, these rows have moved the line
  Wide any = c.zero, longest = c.zero;

  Block(const Wides& wides, const Open& open, std::int32_t column) noexcept
      : c(wides), g(static_cast<std::size_t>(column)), rows(cv::vx_load(open.rows.data() + g)) {}
  // Segments too young for a block are none.
  [[nodiscard]] bool may_go_on() const noexcept { return cv::v_check_all((rows >= c.fitted) | (rows == c.zero)); }

  // As in add_row, but once, at the block's first row: what is nearer is held to the noise of the line's own depth.
  void begin(const Open& open, const Wide& to_centre) noexcept {
    const auto load = [this](const Floats& x) { return cv::vx_load(x.data() + g); };
    slope = load(open.slope), lever = load(open.lever), drift = load(open.drift), absent = load(open.absent);
    value = load(open.value) + slope;
    const Wide my = slope * c.fy, m0 = value + slope * to_centre;
    const Wide sigma = c.sigma(value), share = c.one / (rows + c.four);
    w2 = value * value, leans = c.four * share;
    spread = (my * my + m0 * m0) * (sigma * sigma + c.floor2 * w2 * w2) * (c.one + leans);
    limit = c.outlier2 * spread;
  }
  // The next row, x from the row before the block.
  void add(const Wide& w, const Wide& x) noexcept {
    const Wide valid = w > c.zero, residual = w - value, off = residual - moved;
    const Wide in = valid & (off * off * cv::v_max(w2, w * w) < limit);
    const Wide joined = residual & in, at = x & in, jumped = off & in;
    any = any | valid;
    n = n + (c.one & in), sum_x = sum_x + at, sum_xx = sum_xx + at * x;
    sum_r = sum_r + joined, sum_xr = sum_xr + joined * x;
    moved = moved + leans * jumped;
    drift = drift + ((jumped - drift) * c.memory & in);
    absent = cv::v_select(in, c.zero, absent + cv::v_select(valid, c.outlier_weight, c.one));
    longest = cv::v_max(longest, absent);
    value = value + slope;
  }
  [[nodiscard]] Wide idle() const noexcept { return (rows == c.zero) & (any == c.zero); }
  [[nodiscard]] bool goes_on() const noexcept {
    const Wide bent = (rows + n > c.long_segment) & (drift * drift * w2 > c.bend2 * spread);
    return cv::v_check_all(((rows >= c.fitted) & (longest <= c.max_gap) & ~bent) | idle());
  }
  // Recursive least squares with all of them at once; lever: from the mean of the rows so far.
  void store(Open& open) const noexcept {
    const Wide rows1 = rows + n, mean = c.one / rows1;
    const Wide x_sum = lever * n + sum_x, shift = x_sum * mean;
    const Wide squares =
        cv::vx_load(open.squares.data() + g) + lever * (lever * n + c.two * sum_x) + sum_xx - x_sum * shift;
    const Wide gain = (lever * sum_r + sum_xr - shift * sum_r) / squares, lever1 = lever + c.four - shift;
    const Wide stays = idle();
    const auto put = [this, &stays](Floats& to, const Wide& x) {
      cv::v_store(to.data() + g, cv::v_select(stays, cv::vx_load(to.data() + g), x));
    };
    put(open.rows, rows1), put(open.value, value - slope + sum_r * mean + gain * lever1), put(open.slope, slope + gain);
    put(open.lever, lever1), put(open.squares, squares), put(open.drift, drift), put(open.absent, absent);
  }
};

// Two registers at once: a row waits for the one before, registers do not. What is decided is the same for every
// register width: all columns of a group or none. A bit for each group that went on.
std::uint32_t ScanlineSegmentation::try_blocks(const Wides& c, std::int32_t column, std::int32_t row) noexcept {
  constexpr bool kOneGroup = kBlockColumns == kGroup;
  static_assert(kBlockColumns == 2 * Wide::nlanes && (kOneGroup || kGroup == Wide::nlanes));
  Block a(c, open_, column), b(c, open_, column + Wide::nlanes);
  const bool any_a = a.may_go_on(), any_b = b.may_go_on();
  if (kOneGroup ? !any_a || !any_b : !any_a && !any_b) return 0;
  const Wide to_centre = all(cy_ - static_cast<float>(row));
  a.begin(open_, to_centre), b.begin(open_, to_centre);
  Wide x = c.one;
  for (std::int32_t r = row; r < row + kBlock; ++r, x = x + c.one) {
    const float* w = image_->inverse_depth.row(r) + column;
    a.add(cv::vx_load(w), x), b.add(cv::vx_load(w + Wide::nlanes), x);
  }
  const bool on_a = a.goes_on(), on_b = b.goes_on(), both = on_a && on_b;
  if (kOneGroup ? both : on_a) a.store(open_);
  if (kOneGroup ? both : on_b) b.store(open_);
  if (kOneGroup) return static_cast<std::uint32_t>(both) | 1U << kTriedBit;
  return static_cast<std::uint32_t>(on_a) | (on_b ? 2U : 0U) | static_cast<std::uint32_t>(any_a) << kTriedBit |
         (any_b ? 2U << kTriedBit : 0U);
}

// A bit for each of the group's columns in which something ends.
std::uint32_t ScanlineSegmentation::add_row(const Wides& c, std::int32_t first_column, std::int32_t row) noexcept {
  std::uint32_t events = 0;
  const Wide to_centre = all(cy_ - static_cast<float>(row));
  // Whole registers: what columns beyond a narrower image say is never read.
  for (std::int32_t column = first_column; column < first_column + kGroup; column += Wide::nlanes) {
    const auto g = static_cast<std::size_t>(column);
    const auto load = [g](const Floats& x) { return cv::vx_load(x.data() + g); };
    const auto store = [g](Floats& to, const Wide& x) { cv::v_store(to.data() + g, x); };
    const Wide w = cv::vx_load(image_->inverse_depth.row(row) + g), n = load(open_.rows);
    const Wide slope = load(open_.slope), value = load(open_.value) + slope, lever = load(open_.lever) + c.one;
    const Wide valid = w > c.zero, fitted = n >= c.fitted;

    const Wide residual = w - value;
    // Residual across the line in space against sigma_z: dw^2 / (|m|^2 w^2) with m of the line in the column's plane.
    // Both sides are multiplied by w^2, so that sigma is that of the inverse depth.
    const Wide my = slope * c.fy, m0 = value + slope * to_centre;
    const Wide w2 = w * w, sigma = c.sigma(w);
    // Predicting one row past n has about (1 + 4 / n) of a row's variance.
    const Wide share = c.one / (n + c.one);
    const Wide spread = (my * my + m0 * m0) * (sigma * sigma + c.floor2 * w2 * w2) * (c.one + c.four * share);
    // Two rows make no slope: the third is held against the second.
    const Wide off = residual + cv::v_select(fitted, c.zero, slope);
    const Wide jump = c.jump(w);
    const Wide fits = off * off * w2 < cv::v_select(fitted, c.outlier2 * spread, jump * jump * w2);
    const Wide in = valid & fits;

    // Recursive least squares: a row that joins, at distance x from the others' mean, moves the line by its residual.
    const Wide x = lever & in, news = residual & in;
    const Wide lever1 = lever - x * share, squares1 = load(open_.squares) + x * lever1;
    const Wide gain = news * (lever1 / squares1);
    const Wide n1 = n + (c.one & in);
    const Wide drift0 = load(open_.drift), drift = drift0 + (((news & fitted) - drift0) * c.memory & in);
    const Wide absent = cv::v_select(in, c.zero, load(open_.absent) + cv::v_select(valid, c.outlier_weight, c.one));
    store(open_.rows, n1);
    store(open_.value, value + news * share + gain * lever1);
    store(open_.slope, slope + gain);
    store(open_.lever, lever1);
    store(open_.squares, squares1);
    store(open_.drift, drift);
    store(open_.absent, absent);

    const Wide strange = cv::v_select(fitted, c.zero, valid) & ~fits;
    const Wide bent = in & (n1 > c.long_segment) & (drift * drift * w2 > c.bend2 * spread);
    events |= simd::bits(strange | bent | (absent > c.max_gap)) << (column - first_column);
  }
  return events;
}

// Ends the column's segment where it stopped fitting and starts the next one with the rows since.
void ScanlineSegmentation::handle(std::int32_t column, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  std::int32_t from = row;
  if (open_.absent[g] > max_gap_) {
    from = last_accepted(column, row) + 1;
    close(column, from - 1, row);
  } else if (open_.rows[g] >= kFitted) {
    from = row - kBentRows + 1;
    forget(column, from, row);
    close(column, from - 1, row);
  }
  replay(column, from, row);
}

// One column's state, in registers while several rows in turn change it.
struct ScanlineSegmentation::OneColumn {
  float rows = 0.0F, value = kNowhere, slope = 0.0F, lever = 0.0F, squares = kNoSpread, drift = 0.0F, absent = kNever;
  OneColumn() noexcept = default;
  OneColumn(const Open& open, std::size_t g) noexcept
      : rows(open.rows[g]),
        value(open.value[g]),
        slope(open.slope[g]),
        lever(open.lever[g]),
        squares(open.squares[g]),
        drift(open.drift[g]),
        absent(open.absent[g]) {}
  void store(Open& open, std::size_t g) const noexcept {
    open.rows[g] = rows, open.value[g] = value, open.slope[g] = slope, open.lever[g] = lever;
    open.squares[g] = squares, open.drift[g] = drift, open.absent[g] = absent;
  }
};

// Opens a segment at the first row with data. Rows this few make no line: each is held against the one before.
void ScanlineSegmentation::replay(std::int32_t column, std::int32_t from, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  OneColumn segment;
  for (std::int32_t r = from; r <= row; ++r) {
    const float w = image_->inverse_depth(column, r), jump = jump_(w);
    segment.value += segment.slope;
    segment.lever += 1.0F;
    const float residual = w - segment.value, off = residual + segment.slope;
    if (!(w > 0.0F)) {
      segment.absent += 1.0F;
    } else if (segment.rows > 0.0F && off * off < jump * jump) {
      const float share = 1.0F / (segment.rows + 1.0F);
      segment.rows += 1.0F;
      segment.squares += segment.lever * (segment.lever - segment.lever * share);
      segment.lever -= segment.lever * share;
      const float gain = residual * (segment.lever / segment.squares);
      segment.value += residual * share + gain * segment.lever;
      segment.slope += gain;
      segment.absent = 0.0F;
    } else {
      segment = OneColumn();
      segment.rows = 1.0F;
      segment.value = w;
      segment.absent = 0.0F;
      top_[g] = static_cast<std::int16_t>(r);
    }
  }
  segment.store(open_, g);
}

// Takes accepted rows, the last ones up to row, out of the line again.
void ScanlineSegmentation::forget(std::int32_t column, std::int32_t from, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  OneColumn segment(open_, g);
  for (std::int32_t r = from; r <= row; ++r) {
    const float w = image_->inverse_depth(column, r), back = static_cast<float>(r - row);
    const float n = segment.rows - 1.0F, x = segment.lever + back;
    const float squares = segment.squares - x * x * segment.rows / n;
    if (!(w > 0.0F) || n < kFitted || !(squares > 0.0F)) continue;
    const float residual = w - (segment.value + segment.slope * back);
    const float gain = residual * (x * segment.rows / n / squares);
    segment.rows = n;
    segment.squares = squares;
    segment.lever += x / n;
    segment.value -= residual / n + gain * segment.lever;
    segment.slope -= gain;
  }
  segment.store(open_, g);
}

std::int32_t ScanlineSegmentation::last_accepted(std::int32_t column, std::int32_t row) const noexcept {
  const auto g = static_cast<std::size_t>(column);
  float absent = open_.absent[g];
  for (; absent > 0.0F && row > top_[g]; --row)
    absent -= image_->inverse_depth(column, row) > 0.0F ? outlier_weight_ : 1.0F;
  return row;
}

void ScanlineSegmentation::close(std::int32_t column, std::int32_t bottom, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  if (open_.rows[g] < static_cast<float>(kMinRows)) return;
  ScanlineSegment segment;
  segment.top = top_[g];
  segment.bottom = static_cast<std::int16_t>(bottom);
  segment.inverse_depth = open_.value[g] - open_.slope[g] * static_cast<float>(row - segment.top);
  segment.slope = open_.slope[g];
  if (!segments_[g].try_push_back(segment)) ++overflow_;
}

void ScanlineSegmentation::finish() noexcept {
  work_.add(column_count_, 60);
  for (std::int32_t g = 0; g < column_count_; ++g) {
    close(g, last_accepted(g, height_px_ - 1), height_px_ - 1);
  }
}

}  // namespace polygmap
