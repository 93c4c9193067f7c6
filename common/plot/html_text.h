// Text inside HTML, SVG and XML. Pure, any thread.
#pragma once

#include <string>
#include <string_view>

namespace strandcast {

/// The text with the five characters that mean something in HTML, SVG and XML replaced.
std::string html_escaped(std::string_view text);

}  // namespace strandcast
