// What strandcast-report coherence says of hair in air beside what is known of it. Pure functions.
#pragma once

#include <string>

#include "server/report/hair_reality.h"
#include "server/report/html_page.h"

namespace strandcast {

/// The tables as text, for a terminal.
std::string reality_text(const HairReality& reality);
void add_reality(HtmlPage& page, const HairReality& reality);

}  // namespace strandcast
