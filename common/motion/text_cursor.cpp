#include "common/motion/text_cursor.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/base/text.h"

namespace strandcast {
namespace {

constexpr size_t kMaxShownChars = 40;

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/// LF, CRLF and CR end lines; of CRLF the second character does.
bool is_line_end(std::string_view text, size_t at) {
  return text[at] == '\n' || (text[at] == '\r' && !text.substr(at + 1).starts_with('\n'));
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, failure] = std::from_chars(text.data(), end, value);
  if (failure != std::errc{} || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

bool equals_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string shown(std::string_view token) {
  return excerpt(token, kMaxShownChars);
}

std::string_view take_token(std::string_view& line) {
  line = trim(line);
  const auto* end = std::find_if(line.begin(), line.end(), is_blank);
  const std::string_view token = line.substr(0, static_cast<size_t>(end - line.begin()));
  line.remove_prefix(token.size());
  return token;
}

TextCursor::TextCursor(std::string_view text, std::string place) : text_(text), place_(std::move(place)) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (text_.starts_with(kByteOrderMark)) text_.remove_prefix(kByteOrderMark.size());
}

std::string_view TextCursor::next_token() {
  while (offset_ < text_.size() && (is_blank(text_[offset_]) || text_[offset_] == '\n')) {
    if (is_line_end(text_, offset_)) ++line_;
    ++offset_;
  }
  const size_t begin = offset_;
  while (offset_ < text_.size() && !is_blank(text_[offset_]) && text_[offset_] != '\n') ++offset_;
  token_line_ = line_;
  return text_.substr(begin, offset_ - begin);
}

std::string_view TextCursor::rest_of_line() {
  size_t end = offset_;
  while (end < text_.size() && !is_line_end(text_, end)) ++end;
  const std::string_view rest = trim(text_.substr(offset_, end - offset_));
  offset_ = end;
  token_line_ = line_;
  return rest;
}

std::optional<std::string_view> TextCursor::next_line() {
  for (;;) {
    const std::string_view line = rest_of_line();
    const bool is_last = offset_ == text_.size();
    if (!is_last) {
      ++offset_;
      ++line_;
    }
    if (!line.empty()) return line;
    if (is_last) return std::nullopt;
  }
}

}  // namespace strandcast
