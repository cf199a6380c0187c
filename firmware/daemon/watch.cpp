// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/watch.hpp"

#include <cstdio>
#include <iostream>

#include "firmware/daemon/exit_code.hpp"
#include "firmware/live/live_display.hpp"
#include "firmware/live/live_view.hpp"
#include "firmware/mailbox/mailbox_image.hpp"

namespace polygmap::daemon {
namespace {

constexpr std::int64_t kLook_ns = 20'000'000;
constexpr int kSilent_ms = 500;

class Watch {
 public:
  Watch(std::string name, bool json) : name_(std::move(name)), json_(json), display_(std::cout, form_of(json)) {}
  ~Watch() { polygmap_mailbox_detach(&reader_); }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  // Empty, or why this mailbox cannot be read.
  [[nodiscard]] std::string look() {
    if (reader_.box == nullptr) return attach();
    const polygmap_mailbox_result result = polygmap_mailbox_look(&reader_, kSilent_ms, why_);
    if (result != POLYGMAP_MAILBOX_OK) say(why_);
    if (result == POLYGMAP_MAILBOX_DEAD || result == POLYGMAP_MAILBOX_CLOSED) polygmap_mailbox_detach(&reader_);
    if (result != POLYGMAP_MAILBOX_OK) return {};
    said_.clear();
    const std::int64_t wall_ns = polygmap_mailbox_now_ns();
    const std::int64_t stamp_ns = reader_.box->status_lock.written_ns;  // whole, and only for when it is due
    if (!display_.is_due(stamp_ns, wall_ns) || !read_image(*reader_.box, image_)) return {};
    const std::int64_t now_ns = image_.is_virtual ? image_.status.stamp_ns : wall_ns;
    if (!display_.show(meter_.view(image_, now_ns, wall_ns), image_.status.stamp_ns, wall_ns)) {
      return "Cannot write to the standard output";
    }
    return {};
  }

 private:
  using Form = LiveDisplay::Form;
  static Form form_of(bool json) { return json ? Form::kJson : is_terminal() ? Form::kTable : Form::kLines; }

  [[nodiscard]] std::string attach() {
    switch (polygmap_mailbox_attach(&reader_, name_.c_str(), why_)) {
      case POLYGMAP_MAILBOX_OK:
        said_.clear();
        meter_ = LiveMeter();
        display_.begin_anew();
        image_.has_names = false;
        return {};
      case POLYGMAP_MAILBOX_ABSENT:
      case POLYGMAP_MAILBOX_CLOSED:
      case POLYGMAP_MAILBOX_DEAD:
      case POLYGMAP_MAILBOX_SILENT:
        say(std::string(why_) + " Waiting for a writer.");
        return {};
      default:
        break;
    }
    std::string why = why_;
    if (why.ends_with('.')) why.pop_back();  // who complains sets it
    return why;
  }
  // Once, until something else is to be said.
  void say(const std::string& sentence) {
    if (sentence == said_) return;
    // How long it has been silent is another sentence every time.
    const bool is_same =
        !said_.empty() && sentence.substr(0, sentence.find(" for ")) == said_.substr(0, said_.find(" for "));
    said_ = sentence;
    if (is_same) return;
    if (json_) std::fprintf(stderr, "polygmapd: %s\n", sentence.c_str());
    display_.note(sentence);
  }

  std::string name_;
  bool json_;
  LiveDisplay display_;
  polygmap_mailbox_reader reader_ = POLYGMAP_MAILBOX_READER;
  char why_[POLYGMAP_MAILBOX_SENTENCE] = "";
  LiveMeter meter_;
  MailboxImage image_;
  std::string said_;
};

}  // namespace

int run_watch(const std::string& mailbox, bool json, const StopSignals& signals) {
  Watch watch(mailbox, json);
  do {
    if (const std::string wrong = watch.look(); !wrong.empty()) {
      std::fprintf(stderr, "polygmapd: %s.\n", wrong.c_str());
      return number_of(ExitCode::kDevice);
    }
  } while (signals.wait(kLook_ns) == 0);
  return 0;
}

}  // namespace polygmap::daemon
