// Reads untrusted text line by line (LF, CRLF or CR) and token by token, counting lines for error messages.
// Private to common/motion.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Parses a finite number with nothing after it; accepts ".5", "1e-3" and a leading '+'.
std::optional<double> parse_number(std::string_view text);

/// Compares two texts, ignoring ASCII case.
bool equals_ignoring_case(std::string_view a, std::string_view b);

/// Returns the text without blanks (space, tab, CR) at both ends.
std::string_view trim(std::string_view text);

/// Quotes a token for an error message: its first 40 characters, cleaned for one line.
std::string shown(std::string_view token);

class TextCursor {
 public:
  /// Starts reading `text`, which must outlive the cursor; skips a byte order mark.
  TextCursor(std::string_view text, std::string place);

  /// Returns the next token separated by blanks or line ends; empty at the end.
  std::string_view next_token();
  /// Returns the rest of the current line, trimmed.
  std::string_view rest_of_line();
  /// Returns the next line that is not blank, trimmed; nullopt at the end.
  std::optional<std::string_view> next_line();
  /// Returns the number of unread bytes.
  size_t remaining_bytes() const { return text_.size() - offset_; }
  uint64_t line() const { return token_line_; }

  /// Makes an error that names the line of the last token or line read.
  template <class... Args>
  Error fail(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) const {
    return at(fmt::format("{}:{}", place_, token_line_),
              make_error(code, format, std::forward<Args>(args)...));
  }

 private:
  std::string_view text_;
  std::string place_;
  size_t offset_ = 0;
  uint64_t line_ = 1;
  uint64_t token_line_ = 1;
};

/// Splits off the next blank-separated token of a line; empty if there is none.
std::string_view take_token(std::string_view& line);

}  // namespace strandcast
