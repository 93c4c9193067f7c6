#include "common/base/text.h"

#include <algorithm>
#include <iterator>

namespace strandcast {
namespace {

bool is_control(char character) {
  const auto byte = static_cast<unsigned char>(character);
  return byte < 0x20 || byte == 0x7f;
}

/// The character of `length` bytes at `index`.
char32_t character_at(std::string_view text, size_t index, size_t length) {
  const auto lead = static_cast<unsigned char>(text[index]);
  char32_t code = length == 1 ? lead : lead & (0x7fu >> length);
  for (size_t i = 1; i < length; ++i)
    code = code << 6 | (static_cast<unsigned char>(text[index + i]) & 0x3fu);
  return code;
}

struct CodeRange {
  char32_t first, last;
};

// C1 controls, the separators of lines and paragraphs, and the format characters (category Cf) of Unicode 15.
constexpr CodeRange kHidden[] = {
    {0x80, 0x9f},       {0xad, 0xad},       {0x600, 0x605},     {0x61c, 0x61c},     {0x6dd, 0x6dd},
    {0x70f, 0x70f},     {0x890, 0x891},     {0x8e2, 0x8e2},     {0x180e, 0x180e},   {0x200b, 0x200f},
    {0x2028, 0x202e},   {0x2060, 0x206f},   {0xfeff, 0xfeff},   {0xfff9, 0xfffb},   {0x110bd, 0x110bd},
    {0x110cd, 0x110cd}, {0x13430, 0x1343f}, {0x1bca0, 0x1bca3}, {0x1d173, 0x1d17a}, {0xe0000, 0xe007f}};

bool is_hidden(char32_t code) {
  return std::any_of(std::begin(kHidden), std::end(kHidden),
                     [code](const CodeRange& range) { return code >= range.first && code <= range.last; });
}

/// Of at most `limit` characters; what is `refused` becomes '?'.
template <class Refused>
std::string cleaned(std::string_view text, size_t limit, Refused refused) {
  std::string result;
  size_t count = 0;
  for (size_t i = 0; i < text.size() && count < limit; ++count) {
    const size_t length = utf8_length(text, i);
    if (length == 0 || refused(character_at(text, i, length)))
      result += '?';
    else if (is_control(text[i]))
      result += ' ';
    else
      result.append(text, i, length);
    i += std::max<size_t>(length, 1);
  }
  return result;
}

}  // namespace

size_t utf8_length(std::string_view text, size_t index) {
  const auto byte_at = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte_at(index);
  const size_t length = lead < 0x80   ? 1
                        : lead < 0xc2 ? 0
                        : lead < 0xe0 ? 2
                        : lead < 0xf0 ? 3
                        : lead < 0xf5 ? 4
                                      : 0;
  if (length == 0 || index + length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i)
    if ((byte_at(index + i) & 0xc0) != 0x80) return 0;
  if (length == 1) return 1;
  const unsigned char second = byte_at(index + 1);
  // Overlong forms, surrogates and numbers beyond Unicode.
  if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second > 0x9f)) return 0;
  if ((lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second > 0x8f)) return 0;
  return length;
}

bool is_printable(std::string_view text) {
  for (size_t i = 0; i < text.size();) {
    const size_t length = utf8_length(text, i);
    if (length == 0 || is_control(text[i])) return false;
    i += length;
  }
  return true;
}

std::string printable(std::string_view text, size_t limit) {
  return cleaned(text, limit, [](char32_t) { return false; });
}

std::string one_line(std::string_view text, size_t limit) {
  return cleaned(text, limit, is_hidden);
}

std::string excerpt(std::string_view text, size_t limit) {
  const std::string begin = one_line(text, limit);
  return one_line(text, limit + 1) == begin ? begin : begin + "...";
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t";
  const size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

}  // namespace strandcast
