#include "common/log/line_writer.h"

#include <fmt/format.h>
#include <limits.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <mutex>
#include <set>

namespace strandcast {

static_assert(kMaxLogLineBytes <= PIPE_BUF);

namespace {

struct HiddenTexts {
  std::mutex mutex;
  std::set<std::string> texts;
};
HiddenTexts& hidden() {
  static HiddenTexts texts;
  return texts;
}

}  // namespace

void hide_in_lines(const std::vector<std::string>& secrets) {
  const std::lock_guard lock(hidden().mutex);
  for (const std::string& secret : secrets)
    if (!secret.empty()) hidden().texts.insert(secret);
}

std::string without_secrets(std::string_view text) {
  constexpr std::string_view kHidden = "(token)";
  std::string shown(text);
  const std::lock_guard lock(hidden().mutex);
  for (const std::string& secret : hidden().texts)
    for (size_t place = shown.find(secret); place != std::string::npos; place = shown.find(secret, place))
      shown.replace(place, secret.size(), kHidden), place += kHidden.size();
  return shown;
}

void LineWriter::write(std::string_view given) {
  const std::string line = without_secrets(given);
  const uint64_t untold = dropped_ - told_;
  if (untold > 0) {
    if (!write_now(fmt::format("{} lines are missing here: nobody read the log\n", untold))) {
      ++dropped_;
      return;
    }
    told_ += untold;
  }
  constexpr std::string_view kCut = "...\n";
  const bool is_written = line.size() <= kMaxLogLineBytes
                              ? write_now(line)
                              : write_now(line.substr(0, kMaxLogLineBytes - kCut.size()) + std::string(kCut));
  if (!is_written) ++dropped_;
}

/// A pipe without a reader has none: writing to it would end the process.
bool LineWriter::has_room() const {
  pollfd wanted{descriptor_, POLLOUT, 0};
  int ready = 0;
  do {
    ready = poll(&wanted, 1, 0);
  } while (ready < 0 && errno == EINTR);
  return ready == 1 && wanted.revents == POLLOUT;
}

bool LineWriter::write_now(std::string_view line) const {
  if (!has_room()) return false;
  ssize_t written = 0;
  do {
    written = ::write(descriptor_, line.data(), line.size());
  } while (written < 0 && errno == EINTR);
  return written == static_cast<ssize_t>(line.size());
}

}  // namespace strandcast
