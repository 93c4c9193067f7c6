// LineWriter: lines to a descriptor that may be full or have no reader any more. Never waits; what finds no
// room is left out and counted. One thread at a time; of no use for descriptors that several processes fill.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace strandcast {

/// Longest line with its end. A pipe that has room at all takes as much at once (PIPE_BUF).
inline constexpr size_t kMaxLogLineBytes = 4'096;

/// From now on all lines of the process have "(token)" in place of each of these: strangers put them into a
/// path, a name or an assignment. Earlier ones stay hidden. Any thread.
void hide_in_lines(const std::vector<std::string>& secrets);
/// The text without them.
std::string without_secrets(std::string_view text);

class LineWriter {
 public:
  /// Does not own the descriptor.
  explicit LineWriter(int descriptor) : descriptor_(descriptor) {}

  /// `line` ends with a line end; one that is longer than kMaxLogLineBytes is cut. Before the first line that
  /// finds room again comes one that says how many did not.
  void write(std::string_view line);
  /// Lines left out so far. Any thread.
  uint64_t dropped() const { return dropped_; }

 private:
  bool has_room() const;
  bool write_now(std::string_view line) const;

  const int descriptor_;
  std::atomic<uint64_t> dropped_{0};
  uint64_t told_ = 0;  // of the dropped ones
};

}  // namespace strandcast
