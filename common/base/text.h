// Text from outside, made fit for messages, logs and terminals. Text is UTF-8. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace strandcast {

/// Bytes of the UTF-8 character that begins at `index`, 0 when none does: overlong forms, surrogates and
/// numbers beyond Unicode are none. `index` is below text.size().
size_t utf8_length(std::string_view text, size_t index);

/// UTF-8 without control characters (C0 and DEL): what texts on the wire and in scenes have to be.
bool is_printable(std::string_view text);

/// Makes such text, of at most `limit` characters: control characters become spaces, what is no UTF-8 '?'.
std::string printable(std::string_view text, size_t limit);

/// For a line of a log or terminal: as printable(), with '?' also for characters that steer a terminal, break
/// the line, or reorder or hide what stands beside them (C1 controls, separators of lines, format
/// characters).
std::string one_line(std::string_view text, size_t limit);
/// Likewise, with "..." behind it when there is more: what an error quotes.
std::string excerpt(std::string_view text, size_t limit);

/// Without the blanks and tabs around it.
std::string_view trimmed(std::string_view text);

}  // namespace strandcast
