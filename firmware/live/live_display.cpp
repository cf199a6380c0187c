// SPDX-License-Identifier: Apache-2.0
#include "firmware/live/live_display.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ostream>
#include <string_view>
#include <utility>

#include "firmware/live/live_text.hpp"

namespace polygmap {
namespace {

constexpr std::size_t kNotes = 3;
constexpr std::int64_t kTable_ns = 100'000'000, kLine_ns = 1'000'000'000;

}  // namespace

TerminalSize terminal_size() noexcept {
  winsize size{};
  TerminalSize known;
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0) return known;
  if (size.ws_col > 0) known.columns = size.ws_col;
  if (size.ws_row > 0) known.lines = size.ws_row;
  return known;
}

bool is_terminal() noexcept {
  const char* const kind = std::getenv("TERM");
  return ::isatty(STDOUT_FILENO) != 0 && kind != nullptr && std::string_view(kind) != "dumb";
}

bool LiveDisplay::show(const LiveView& view, std::int64_t stamp_ns, std::int64_t wall_ns) {
  switch (form_) {
    case Form::kTable:
      next_ns_ = wall_ns + kTable_ns;
      draw(table_of(view, std::max<std::size_t>(size_().columns, 21) - 1));
      break;
    case Form::kLines:
    case Form::kJson:
      next_ns_ = stamp_ns + kLine_ns;
      out_ << (form_ == Form::kJson ? json_of(view) : line_of(view)) << "\n" << std::flush;
      break;
  }
  return static_cast<bool>(out_);
}

void LiveDisplay::note(const std::string& sentence) {
  if (form_ == Form::kLines) out_ << sentence << "\n" << std::flush;
  if (form_ != Form::kTable) return;
  notes_.push_back(sentence);
  if (notes_.size() > kNotes) notes_.pop_front();
  draw(table_);
}

NoteBuffer::int_type NoteBuffer::overflow(int_type c) {
  if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
  if (c != '\n') {
    line_ += traits_type::to_char_type(c);
    return c;
  }
  display_.note(line_);
  line_.clear();
  return c;
}

// In one write, so that nothing half drawn is seen. What does not fit below each other is left out: the cursor cannot
// go back to lines that have left the screen.
void LiveDisplay::draw(std::vector<std::string> lines) {
  const TerminalSize size = size_();
  table_ = lines;
  for (const std::string& note : notes_) lines.push_back(note.substr(0, std::max<std::size_t>(size.columns, 2) - 1));
  if (lines.size() + 1 > size.lines) lines.resize(std::max<std::size_t>(size.lines, 2) - 1);
  std::string text;
  const bool is_resized = drawn_ > 0 && !(size == drawn_on_);
  if (is_resized) {
    text = "\x1b[2J\x1b[H";  // where the lines have gone is not known
  } else if (drawn_ > 0) {
    text = "\x1b[" + std::to_string(drawn_) + "A\r";
  }
  for (const std::string& line : lines) text += line + "\x1b[K\n";
  text += "\x1b[J";
  drawn_ = lines.size();
  drawn_on_ = size;
  out_ << text << std::flush;
}

}  // namespace polygmap
