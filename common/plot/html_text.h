// Escaping of text for HTML, SVG and XML. Pure functions, any thread.
#pragma once

#include <string>
#include <string_view>

namespace strandcast {

/// Replaces the five characters that have a meaning in HTML, SVG and XML with entities.
std::string html_escaped(std::string_view text);

}  // namespace strandcast
