// Checks and cleans untrusted UTF-8 text for messages, logs and terminals. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace strandcast {

/// Number of bytes of the UTF-8 character that begins at `index` (below text.size()). Returns 0 if none
/// begins there: overlong forms, surrogates and code points beyond Unicode are invalid.
size_t utf8_length(std::string_view text, size_t index);

/// Returns true for valid UTF-8 without control characters (C0 and DEL). Texts on the wire and in scenes must
/// be printable.
bool is_printable(std::string_view text);

/// Makes printable text of at most `limit` characters: control characters become spaces, invalid bytes '?'.
std::string printable(std::string_view text, size_t limit);

/// Makes text safe for a line of a log or terminal. Cleans it like printable(), and also replaces C1
/// controls, line separators and format characters (which reorder or hide text) with '?'.
std::string one_line(std::string_view text, size_t limit);
/// Cleans text like one_line() and appends "..." if it was cut; errors quote input in this form.
std::string excerpt(std::string_view text, size_t limit);

/// Returns the text without leading and trailing blanks and tabs.
std::string_view trimmed(std::string_view text);

}  // namespace strandcast
