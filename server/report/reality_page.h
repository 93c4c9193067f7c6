// The part of strandcast-report coherence that compares hair in air with known results. Pure functions.
#pragma once

#include <string>

#include "server/report/hair_reality.h"
#include "server/report/html_page.h"

namespace strandcast {

/// Returns the tables as text for a terminal.
std::string reality_text(const HairReality& reality);
void add_reality(HtmlPage& page, const HairReality& reality);

}  // namespace strandcast
