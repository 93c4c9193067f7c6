// Reads untrusted text line by line and token by token, counting lines for error messages. Private to
// common/motion.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Finite number with nothing after it; a leading '+' is allowed, as in ".5" and "1e-3".
std::optional<double> parse_number(std::string_view text);

/// Equal when ASCII case is ignored.
bool equals_ignoring_case(std::string_view a, std::string_view b);

/// Text without blanks (space, tab, CR) at both ends.
std::string_view trim(std::string_view text);

/// A token as shown in an error: its first 40 characters, fit for one line.
std::string shown(std::string_view token);

class TextCursor {
 public:
  /// A byte order mark at the start is skipped. `text` must outlive the cursor.
  TextCursor(std::string_view text, std::string place);

  /// The next token separated by blanks or line ends; empty at the end.
  std::string_view next_token();
  /// What is left of the current line, trimmed.
  std::string_view rest_of_line();
  /// The next line that has anything in it, trimmed; nullopt at the end.
  std::optional<std::string_view> next_line();
  /// Bytes not yet read.
  size_t remaining_bytes() const { return text_.size() - offset_; }
  uint64_t line() const { return token_line_; }

  /// An error at the line of the last token or line read.
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

/// Splits off the next blank-separated token of a line; empty when there is none.
std::string_view take_token(std::string_view& line);

}  // namespace strandcast
