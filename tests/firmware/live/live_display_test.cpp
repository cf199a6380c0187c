// SPDX-License-Identifier: Apache-2.0
// What a terminal and a pipe are sent.
#include "firmware/live/live_display.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace polygmap {
namespace {

using Form = LiveDisplay::Form;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

LiveView some_view(std::size_t rows = 2) {
  LiveView view;
  view.state = "standing";
  view.waits_for = "nothing";
  view.stop_reason = view.no_way = "none";
  view.rows.resize(rows);
  view.worst_row = rows;
  return view;
}
// What stands on a screen of so many lines after all that was written to it; empty lines at its end left out.
std::vector<std::string> screen_after(const std::string& written, std::size_t height) {
  std::vector<std::string> screen(1);
  std::size_t line = 0, column = 0;
  for (std::size_t i = 0; i < written.size(); ++i) {
    if (written[i] == '\n') {
      if (++line == screen.size()) screen.emplace_back();
      column = 0;
    } else if (written[i] == '\r') {
      column = 0;
    } else if (written[i] == '\x1b') {
      const std::size_t end = written.find_first_of("AHJK", i);
      const std::string number = written.substr(i + 2, end - i - 2);
      const std::size_t top = screen.size() > height ? screen.size() - height : 0;
      if (written[end] == 'A') line = std::max(top + 1, line + 1 - std::min(line, std::stoul(number))) - 1;
      if (written[end] == 'H') line = top, column = 0;
      if (written[end] == 'K') screen[line].resize(column);
      if (written[end] == 'J' && number.empty()) screen.resize(line + 1), screen[line].resize(column);
      if (written[end] == 'J' && number == "2") std::fill(screen.begin() + static_cast<long>(top), screen.end(), "");
      i = end;
    } else {
      screen[line].resize(std::max(screen[line].size(), column + 1), ' ');
      screen[line][column++] = written[i];
    }
  }
  while (!screen.empty() && screen.back().empty()) screen.pop_back();
  return screen;
}

TEST(LiveDisplay, Table_StandsInItsPlaceAndIsWrittenInOnePiece) {
  std::ostringstream out;
  LiveDisplay display(out, Form::kTable, [] { return TerminalSize{100, 40}; });
  EXPECT_TRUE(display.show(some_view(), 0, 0));
  const std::vector<std::string> first = screen_after(out.str(), 40);
  LiveView second = some_view();
  second.state = "climbing";
  second.faults = {{"imu_missing", 3}};
  EXPECT_TRUE(display.show(second, kSecond_ns, kSecond_ns));
  const std::vector<std::string> then = screen_after(out.str(), 40);
  EXPECT_EQ(first.size(), then.size());
  EXPECT_NE(first[0].find("standing"), std::string::npos);
  EXPECT_NE(then[0].find("climbing"), std::string::npos);
  EXPECT_EQ(out.str().find("\x1b[2J"), std::string::npos) << "a screen that is cleared flickers";
}

TEST(LiveDisplay, TableLongerThanTheScreen_StaysOnIt) {
  std::ostringstream out;
  LiveDisplay display(out, Form::kTable, [] { return TerminalSize{100, 10}; });
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(display.show(some_view(12), i, i));
  const std::vector<std::string> screen = screen_after(out.str(), 10);
  EXPECT_EQ(screen.size(), 9U) << "the cursor's line is the tenth";
}

TEST(LiveDisplay, TableShrinks_NothingOfItIsLeft) {
  std::ostringstream out;
  LiveDisplay display(out, Form::kTable, [] { return TerminalSize{100, 40}; });
  EXPECT_TRUE(display.show(some_view(9), 0, 0));
  EXPECT_TRUE(display.show(some_view(2), 0, 0));
  std::ostringstream alone;
  LiveDisplay other(alone, Form::kTable, [] { return TerminalSize{100, 40}; });
  EXPECT_TRUE(other.show(some_view(2), 0, 0));
  EXPECT_EQ(screen_after(out.str(), 40), screen_after(alone.str(), 40));
}

TEST(LiveDisplay, TerminalIsResized_TableBeginsAnew) {
  std::ostringstream out;
  TerminalSize size{100, 40};
  LiveDisplay display(out, Form::kTable, [&size] { return size; });
  EXPECT_TRUE(display.show(some_view(), 0, 0));
  size.columns = 30;
  EXPECT_TRUE(display.show(some_view(), 0, 0));
  for (const std::string& line : screen_after(out.str(), 40)) EXPECT_LT(line.size(), 30U) << line;
}

TEST(LiveDisplay, Notes_StandBelowTheTableTheNewestThree) {
  std::ostringstream out;
  LiveDisplay display(out, Form::kTable, [] { return TerminalSize{100, 40}; });
  EXPECT_TRUE(display.show(some_view(), 0, 0));
  const std::size_t lines = screen_after(out.str(), 40).size();
  NoteBuffer buffer(display);
  std::ostream notes(&buffer);
  for (const char* word : {"one", "two", "three", "four"}) notes << word << "\n" << std::flush;
  EXPECT_TRUE(display.show(some_view(), 0, 0));
  const std::vector<std::string> screen = screen_after(out.str(), 40);
  ASSERT_EQ(screen.size(), lines + 3);
  EXPECT_EQ(screen[lines], "two");
  EXPECT_EQ(screen.back(), "four");
}

TEST(LiveDisplay, Pipe_GetsPlainLinesOneASecondOfTheViewsClock) {
  std::ostringstream out;
  LiveDisplay display(out, Form::kLines);
  int shown = 0;
  for (std::int64_t stamp_ns = 0; stamp_ns < 5 * kSecond_ns; stamp_ns += 2'000'000) {
    if (!display.is_due(stamp_ns, 0)) continue;
    ++shown;
    EXPECT_TRUE(display.show(some_view(), stamp_ns, 0));
  }
  EXPECT_EQ(shown, 5);
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(LiveDisplay, Json_HasObjectsAlone) {
  std::ostringstream out;
  LiveDisplay display(out, Form::kJson);
  display.note("a sentence");
  EXPECT_EQ(out.str(), "");
  EXPECT_TRUE(display.show(some_view(), 0, 0));
  EXPECT_EQ(out.str().front(), '{');
  EXPECT_TRUE(out.str().ends_with("}\n"));
}

TEST(LiveDisplay, OutputIsGone_SaysSo) {
  std::ostringstream out;
  LiveDisplay display(out, Form::kLines);
  out.setstate(std::ios::badbit);
  EXPECT_FALSE(display.show(some_view(), 0, 0));
}

}  // namespace
}  // namespace polygmap
