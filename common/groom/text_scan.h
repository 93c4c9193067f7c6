// TextScan: reads lines and words of text with LF, CRLF, CR or mixed line ends, and parses numbers
// independently of the locale. Used by the text loaders of this folder. Any thread; holds views into the
// text, which must outlive it.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/base/result.h"
#include "common/base/text.h"

namespace strandcast {

/// The text behind the mark that some editors begin it with.
inline std::string_view without_byte_order_mark(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  return text.starts_with(kByteOrderMark) ? text.substr(kByteOrderMark.size()) : text;
}

class TextScan {
 public:
  explicit TextScan(std::string_view text) : text_(text) {}

  /// Moves to the next line; returns false at the end of the text.
  bool next_line() {
    if (begin_ >= text_.size()) return false;
    size_t end = text_.find_first_of("\r\n", begin_);
    if (end == std::string_view::npos) end = text_.size();
    rest_ = text_.substr(begin_, end - begin_);
    const bool is_crlf = end + 1 < text_.size() && text_[end] == '\r' && text_[end + 1] == '\n';
    begin_ = end + (is_crlf ? 2 : 1);
    ++line_;
    return true;
  }

  /// Moves to the next line that contains a word.
  bool next_filled_line() {
    while (next_line()) {
      skip_space();
      if (!rest_.empty()) return true;
    }
    return false;
  }

  /// Returns the next word of the line, empty at its end. Blanks, tabs and commas separate words.
  std::string_view next_word() {
    skip_space();
    size_t end = rest_.find_first_of(kSpace);
    if (end == std::string_view::npos) end = rest_.size();
    const std::string_view word = rest_.substr(0, end);
    rest_.remove_prefix(end);
    return word;
  }

  /// Returns what follows the last word in its line.
  std::string_view rest() const { return rest_; }
  uint32_t line() const { return line_; }  // 1-based

 private:
  static constexpr std::string_view kSpace = " \t,\v\f";
  void skip_space() { rest_.remove_prefix(std::min(rest_.find_first_not_of(kSpace), rest_.size())); }

  std::string_view text_, rest_;
  size_t begin_ = 0;
  uint32_t line_ = 0;
};

/// Parses the whole word as a number; empty if it is none or does not fit. Accepts infinities and NaN, also
/// as some C libraries write them ("-1.#IND").
template <class T>
std::optional<T> parse_number(std::string_view word) {
  if constexpr (std::is_floating_point_v<T>)
    if (word.find("1.#") <= 1) return std::numeric_limits<T>::quiet_NaN();
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  T value{};
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Quotes a word from a file for an error message: its first 40 characters, cleaned for one line.
inline std::string quoted(std::string_view word) {
  constexpr size_t kMaxQuotedChars = 40;
  return fmt::format("'{}'", excerpt(word, kMaxQuotedChars));
}

/// Makes an error that names the current line of the scan.
template <class... Args>
Error line_error(const TextScan& scan, ErrorCode code, fmt::format_string<Args...> format, Args&&... args) {
  return at(fmt::format("line {}", scan.line()), make_error(code, format, std::forward<Args>(args)...));
}

}  // namespace strandcast
