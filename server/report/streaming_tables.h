// Tables of the streaming report's page that a reader looks for first: what a viewer's link has to carry, and
// every clip, strand model and wind. Any thread.
#pragma once

#include "server/report/html_page.h"
#include "server/report/streaming.h"

namespace strandcast {

/// Mbit/s at the goals' bound of every codec of ours and of the best peers: for the built-in scene and for
/// the largest number of vertices, in the first recording of each class; with milliseconds of both sides.
HtmlTable needs_table(const StreamingReport& report);
/// The answer in words: the codec with the fewest bits.
std::string needs_text(const StreamingReport& report);
/// Bits per vertex by bound, of every clip, part, strand model, codec of ours and wind, at the first size.
HtmlTable case_table(const StreamingReport& report);
/// Which clips there were.
std::string clips_text(const StreamingReport& report);

}  // namespace strandcast
