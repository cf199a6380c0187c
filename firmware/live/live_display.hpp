// SPDX-License-Identifier: Apache-2.0
// Shows views as they come: in place on a terminal, a line a second elsewhere, or an object a second.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <ostream>
#include <streambuf>
#include <string>
#include <utility>
#include <vector>

#include "firmware/live/live_view.hpp"

namespace polygmap {

struct TerminalSize {
  std::size_t columns = 80, lines = 24;
  [[nodiscard]] bool operator==(const TerminalSize&) const noexcept = default;
};
// Of the standard output.
[[nodiscard]] TerminalSize terminal_size() noexcept;
// The standard output is one that can move its cursor.
[[nodiscard]] bool is_terminal() noexcept;

class LiveDisplay {
 public:
  enum class Form { kTable, kLines, kJson };
  LiveDisplay(std::ostream& out, Form form, std::function<TerminalSize()> size = terminal_size)
      : out_(out), form_(form), size_(std::move(size)) {}

  // A table is shown anew ten times in a second of the wall clock; lines and objects once in a second of the view's.
  [[nodiscard]] bool is_due(std::int64_t stamp_ns, std::int64_t wall_ns) const noexcept {
    return form_ == Form::kTable ? wall_ns >= next_ns_ : stamp_ns >= next_ns_;
  }
  // What comes next has stamps of another clock.
  void begin_anew() noexcept { next_ns_ = 0; }
  // Not asked whether it is due. False when it cannot be written any more.
  bool show(const LiveView& view, std::int64_t stamp_ns, std::int64_t wall_ns);
  // A sentence, which stays below the table for a while; not among objects.
  void note(const std::string& sentence);

 private:
  void draw(std::vector<std::string> lines);

  std::ostream& out_;
  Form form_;
  std::function<TerminalSize()> size_;
  std::int64_t next_ns_ = 0;
  std::size_t drawn_ = 0;  // lines above the cursor that are the table's
  TerminalSize drawn_on_;
  std::vector<std::string> table_;  // as drawn last
  std::deque<std::string> notes_;   // the last few
};

// Of a stream whose lines become notes of a display.
class NoteBuffer final : public std::streambuf {
 public:
  explicit NoteBuffer(LiveDisplay& display) : display_(display) {}

 private:
  int_type overflow(int_type c) override;

  LiveDisplay& display_;
  std::string line_;
};

}  // namespace polygmap
